"""One surface in two versions: displacement of its vertices, and bounds of it.

A displacement |D·p| is convex in p, so that over a box it is largest at a corner, and for a blend of joints at most the
largest joint's. That bounds every time cheaply. Without morphing the displacement is linear in the joints' matrices, so
that one product of matrices computes it for many vertices and times.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix
from anim.measure.error.displacement import BoundGroups, DisplacementField, MorphedDisplacement, SkinnedDisplacement
from anim.measure.error.influences import GroupedInfluences
from anim.measure.error.max_displacement import MaxDisplacement
from anim.measure.error.morph_bounds import SIDES, Change, MorphBounds
from anim.measure.error.surface import Surface, morph_points, skin_points
from anim.model import Pose
from anim.sampling.pose import PosedSkeleton


class Binding(NamedTuple):
    """Joints of a surface in one version of the scene.

    nodes: (J,) the joints, −1 for the world itself. bind: (J, 3, 4) joint_from_mesh.
    owner: the node with the morph weights, −1 for none. rest_weights: (M,), without a track.
    """

    nodes: Ints
    bind: Floats
    owner: int
    rest_weights: Floats

    def weights(self, pose: Pose) -> Floats:
        """Return the morph weights (F, M) of a pose."""
        found = pose.weights.get(self.owner)
        if found is not None and found.shape[1] == len(self.rest_weights):
            return found
        return np.broadcast_to(self.rest_weights, (len(pose.times), len(self.rest_weights)))


class PointGroups(Protocol):
    """Points that move together: those of a mesh, or shells."""

    @property
    def groups(self) -> Sequence[Ints]:
        """Indices of the points (V_g,) of each group."""
        ...

    @property
    def name(self) -> str:
        """Name of the mesh or node, for reports; empty if each group has its own."""
        ...

    def name_of(self, found: MaxDisplacement) -> str:
        """Return the name of the mesh or node of what was found; empty for shells."""
        ...

    def field(self, old: PosedSkeleton, new: PosedSkeleton) -> DisplacementField | None:
        """Return the displacement of every point at every time, None without points."""
        ...

    def weights(self, old: PosedSkeleton, new: PosedSkeleton) -> list[tuple[int, Floats, Floats]]:
        """Return the nodes with morph weights, in the first scene, with the weights (F, M) of both versions."""
        ...

    def leader(self, group: int) -> int:
        """Return the index of the node with the largest weight on a group, in the first scene."""
        ...

    def node(self, joint: int) -> int:
        """Return the index of the node of a field's joint, in the first scene."""
        ...

    def vertex(self, found: MaxDisplacement) -> int:
        """Return the index in the mesh of the vertex that was found, −1 for none."""
        ...

    def is_shell(self, group: int) -> bool:
        """Return whether a group's points are around nodes that move no vertex."""
        ...


class SkinnedGroups:
    """A surface with vertices grouped by their main joint, and boxes around joints' vertices.

    surface: its points can be (V, I, 3), of each influence, if it has no morph targets.
    new: joints of the surface in the second version, if they differ. used: indices of the joints with influence.
    reach: of each group the joints with influence, as indices into `used`. fraction: the largest sum of skin weights of
    a vertex. bound_groups: the vertices at the rest weights of morph targets, in mesh space.
    """

    def __init__(self, surface: Surface, new: Binding | None = None) -> None:
        self.surface = surface
        self.old = Binding(surface.nodes, surface.bind, surface.owner, surface.rest_weights)
        self.new = new or self.old
        rest = surface.points
        if len(surface.targets):
            rest = rest + np.tensordot(surface.rest_weights, surface.targets, axes=1)
        self.fraction, self.used, influences = self._influenced()
        boxes: Callable[[Floats], Floats]
        if surface.is_rigid:  # often one of thousands, or with points of thousands of nodes
            self._leaders, self.groups, self.reach = [0], [np.arange(len(surface.points))], [self.used]
            products = [np.concatenate((rest, np.ones((len(rest), 1))), axis=1)]
            boxes = _whole_box
        else:
            grouped = GroupedInfluences(influences, surface.weights, len(self.used))
            self._leaders, self.groups, self.reach = grouped.main_joints, grouped.groups, grouped.reach
            products, boxes = grouped.products(rest), grouped.boxes
        self.bound_groups = BoundGroups(self.reach, products, boxes(rest), self.fraction)
        corners = boxes(surface.points) if len(surface.targets) else self.bound_groups.corners
        self._boxed = MorphBounds(corners, np.abs(surface.targets).max(axis=1, initial=0.0), self.fraction)

    def field(self, old: PosedSkeleton, new: PosedSkeleton) -> DisplacementField | None:
        """Return the displacement of every vertex at every time, None without joints."""
        if not self.groups or not len(old.pose.times):
            return None
        bind = self.new.bind[self.used][:, None]
        before, after = old.of(self.old.nodes[self.used]), new.of(self.new.nodes[self.used])
        if self.new is self.old:  # one product for both
            moved = matrix.multiply(after - before, bind)
        else:
            moved = matrix.multiply(after, bind) - matrix.multiply(before, self.old.bind[self.used][:, None])
        before_weights, after_weights = self.old.weights(old.pose), self.new.weights(new.pose)
        rest = self.surface.rest_weights
        if (before_weights == rest).all() and (after_weights == rest).all():
            return SkinnedDisplacement(self.bound_groups, moved)
        change = Change(moved, matrix.multiply(after, bind), before_weights, after_weights)
        return MorphedDisplacement(
            self._boxed.sizes(change),
            (self.bound_groups.reach, self.groups),
            displaced=lambda frames: self._displaced(frames, old, new),
            rates=lambda step: self._boxed.rates(change, step),
        )

    def weights(self, old: PosedSkeleton, new: PosedSkeleton) -> list[tuple[int, Floats, Floats]]:
        """Return the node with morph weights, in the first scene, with the weights (F, M) of both versions."""
        if not len(self.surface.targets):
            return []
        return [(self.old.owner, self.old.weights(old.pose), self.new.weights(new.pose))]

    @property
    def name(self) -> str:
        """Name of the mesh or node, for reports."""
        return self.surface.name

    def name_of(self, found: MaxDisplacement) -> str:
        """Return the name of the mesh or node."""
        del found
        return self.name

    def leader(self, group: int) -> int:
        """Return the index of the node with the largest weight on each vertex of a group, in the first scene."""
        return self.node(self._leaders[group])

    def node(self, joint: int) -> int:
        """Return the index of the node of a used joint, in the first scene."""
        return int(self.old.nodes[self.used[joint]])

    def vertex(self, found: MaxDisplacement) -> int:
        """Return the index in the mesh of the vertex that was found, −1 if only a bound was evaluated."""
        return int(self.groups[found.group][found.vertex]) if found.vertex >= 0 else -1

    def is_shell(self, group: int) -> bool:
        """Return False: these are vertices."""
        del group
        return False

    def _influenced(self) -> tuple[float, Ints, Ints]:
        """The largest sum of skin weights, the joints with influence (J,), and those of vertices (V, I) into them."""
        surface = self.surface
        if surface.is_rigid:
            return 1.0, np.zeros(1, np.int64), surface.joints
        carrying = surface.weights > 0
        used = np.array(sorted(set(surface.joints[carrying].tolist())), np.int64)
        place = np.full(len(surface.nodes), -1)
        place[used] = np.arange(len(used))
        fraction = max(float(surface.weights.sum(axis=1).max(initial=0.0)), 1e-30)
        return fraction, used, np.where(carrying, place[surface.joints], 0)

    def _displaced(self, frames: Ints, old: PosedSkeleton, new: PosedSkeleton) -> Floats:
        """Displacement of every vertex (V, 3, f) in some frames, morphed and then skinned."""
        result = np.zeros((*self.surface.points.shape, len(frames)))
        for carried, posed, sign in ((self.new, new, 1), (self.old, old, -1)):
            points = morph_points(self.surface, carried.weights(posed.pose)[frames])
            bound = matrix.multiply(posed.of(carried.nodes)[:, frames], carried.bind[:, None])
            for i in range(len(frames)):
                result[..., i] += sign * skin_points(self.surface, points[i], bound[:, i])
        return result


def _whole_box(points: Floats) -> Floats:
    """Corners (1, 8, 3) of the box around all points (V, 3)."""
    return np.asarray(np.where(SIDES < 0, points.min(axis=0), points.max(axis=0)))[None]
