"""Motion of a scene's vertices: their positions, steps and changes of velocity."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix
from anim.measure.error import orientation_probes, point_matrix
from anim.measure.error.point_matrix import PointMatrix, PointRows
from anim.measure.error.surface import Surface, has_vertices, morph_points, skin_points, surfaces
from anim.measure.loops import clip_ends
from anim.measure.loops.clip_ends import EndPoses, LoopRange
from anim.model import Clip, Scene
from anim.sampling.pose import rest_world, sample_pose, sample_world_matrices
from anim.sampling.world import world_by_node

MOTION = np.array([-1.0, 1])  # weights of two frames: the motion between them
VELOCITY_CHANGE = np.array([1.0, -1, -1, 1])  # weights of two times before and two after a key: the change of velocity
MAX_BATCH_VALUES = 1_000_000  # maximum number of values in the arrays of one step
MAX_MATRICES = 1_000_000  # maximum number of world matrices at once, 96 bytes each


class SkinMotion:
    """Points of a scene on which motion is measured: its vertices.

    Gaps and steps are measured on all of them, long time ranges (`places`) on the outermost ones of each joint. In a
    scene without vertices all nodes count, with six points around each; otherwise nodes that move no vertex (IK
    controls, cameras) do not count.
    """

    def __init__(self, scene: Scene) -> None:
        self.skeleton = scene.skeleton
        self._scene = scene
        self.is_skin = has_vertices(scene)
        self.surfaces = surfaces(scene) if self.is_skin else []
        self.rest_world = rest_world(scene.skeleton)[:, None]
        self._lever = (
            orientation_probes.PROBE_DISTANCE * orientation_probes.probe_size(self.rest_world[..., 3])
            if len(scene.skeleton)
            else 0.0
        )

    @cached_property
    def points(self) -> PointMatrix:
        """The outermost points of each joint."""
        if not self.is_skin:
            return self.vertices
        return point_matrix.sample_points(self._scene, frozenset(), self._lever)

    @cached_property
    def size(self) -> float:
        """Diagonal of the scene's bounding box in the rest pose, in metres; 1 without one."""
        return orientation_probes.probe_size(self.points.places(self.rest_world)) if len(self.points) else 1.0

    @cached_property
    def _all(self) -> tuple[PointMatrix, Ints]:
        """The distinct points of all meshes, and the node of each one's mesh (P,).

        Vertices that differ only in texture coordinates or normals always move alike.
        """
        points = point_matrix.all_points(self._scene, self._lever)
        if not self.is_skin:
            return points, np.arange(len(points))
        owners = np.repeat([part.owner for part in self.surfaces], [len(part.points) for part in self.surfaces])
        chosen = points.distinct(owners)
        return points.take(chosen), owners[chosen]

    @property
    def vertices(self) -> PointMatrix:
        """All distinct points."""
        return self._all[0]

    @cached_property
    def _rows(self) -> PointRows:
        return self.vertices.rows()

    @property
    def owners(self) -> Ints:
        """The node of each point's mesh (P,)."""
        return self._all[1]

    def places(self, clip: Clip, times: Floats, root: int = -1) -> Floats:
        """Return the positions of the outermost points (P, F, 3) at times (F,).

        The displacement of node `root` is removed.
        """
        world = world_by_node(self.skeleton, sample_pose(self.skeleton, clip, times))
        clip_ends.remove_root_motion(self.skeleton, world, root)
        return self.points.places(world)

    def steps(self, clip: Clip, times: Floats, root: int = -1) -> Floats:
        """Return the largest distance (F,) that a vertex moves from the first of times (2, F) to the second.

        The displacement of node `root` is removed.
        """
        return self._combined(clip, times, MOTION, root)

    def velocity_changes(self, clip: Clip, times: Floats, root: int = -1) -> Floats:
        """Return the largest change of velocity (K,) of a vertex at times (K,), in m/s, without jumps.

        Measured like `Seam.speed`, without the displacement of node `root`.
        """
        whole = LoopRange(clip, clip.start, clip.end, root=root)
        around = np.array([-whole.probe, -whole.shortest, whole.shortest, whole.probe])[:, None]
        held = np.array([-whole.shortest] * 2 + [whole.shortest] * 2)[:, None]
        moves = self._combined(clip, times + around, VELOCITY_CHANGE, root, held=times + held)
        return np.asarray(moves / (whole.probe - whole.shortest))

    def squares(self, differences: Callable[[Ints], Floats]) -> Floats:
        """Return the squared lengths (P, F) of differences of all points.

        differences: gives those of world matrices (J, F, 3, 4) of nodes (J,).
        """
        return self._rows.squares(point_matrix.stack_blocks(differences, self.vertices.nodes))

    def posed_at_once(self, times: int) -> int:
        """Return the number of clips, or frames, at so many times each, of which all matrices are computed at once."""
        return max(MAX_MATRICES // max(times * len(self.skeleton), 1), 1)

    def batch_size(self, matrices: int) -> int:
        """Return the number of frames that fit into one batch, with so many matrices per node and frame."""
        return max(MAX_BATCH_VALUES // max(3 * matrices * len(self.vertices), 1), 1)

    def exclude_morphing(self, squares: Floats, weights: Mapping[int, Floats]) -> list[Surface]:
        """Set the squares (P, ...) of morphing meshes to 0, and return these meshes. weights: by node."""
        morphing = [mesh for mesh in self.surfaces if len(mesh.targets) and mesh.owner in weights]
        if morphing:
            squares[np.isin(self.owners, [mesh.owner for mesh in morphing])] = 0
        return morphing

    def _combined(self, clip: Clip, times: Floats, weights: Floats, root: int, *, held: Floats | None = None) -> Floats:
        """Return the longest (F,) weighted sums of positions at times (S, F).

        weights: (S,). held: times of STEP tracks.
        """
        most = self.posed_at_once(len(times))
        parts = []
        origin: Floats | None = None
        for start in range(0, times.shape[1], most):
            some = times[:, start : start + most]
            stops = None if held is None else held[:, start : start + most].reshape(1, -1)
            world, (morphs,) = sample_world_matrices(self.skeleton, [clip], some.reshape(1, -1), step_times=stops)
            origin = world[root, 0, :, 3].copy() if origin is None else origin
            clip_ends.remove_root_motion(self.skeleton, world, root, origin)
            world = world.reshape(len(world), *some.shape, 3, 4)
            morphs = {node: each.reshape(*some.shape, -1) for node, each in morphs.items()}
            count = self.batch_size(len(times))
            for first in range(0, some.shape[1], count):
                cut = slice(first, first + count)
                of_morphs = {node: each[:, cut] for node, each in morphs.items()}
                parts.append(self._longest(world[:, :, cut], of_morphs, weights))
        return np.concatenate(parts)

    def _longest(self, world: Floats, morphs: Mapping[int, Floats], weights: Floats) -> Floats:
        """world: (N, S, F, 3, 4). morphs: (S, F, M) by node. weights: (S,)."""
        size, stops, frames = world.shape[:3]
        squares = self.squares(lambda nodes: np.tensordot(weights, world[nodes], (0, 1)))
        morphing = self.exclude_morphing(squares, morphs)
        most = np.sqrt(squares.max(axis=0)).astype(np.float64)
        for mesh in morphing:
            seen = EndPoses(world.reshape(size, -1, 3, 4), {mesh.owner: morphs[mesh.owner].reshape(stops * frames, -1)})
            moved = np.tensordot(weights, morphed_vertices(mesh, seen).reshape(stops, frames, -1, 3), (0, 0))
            most = np.maximum(most, longest_each(moved))
        return np.asarray(most)


def morphed_vertices(mesh: Surface, seen: EndPoses) -> Floats:
    """Return the vertices (T, V, 3) of a morphing mesh, at the times of the ends."""
    placed = [
        skin_points(mesh, *each)
        for each in zip(
            morph_points(mesh, seen.weights[mesh.owner]),
            matrix.multiply(np.swapaxes(seen.world[mesh.nodes], 0, 1), mesh.bind),
            strict=True,
        )
    ]
    return np.stack(placed)


def longest_each(vectors: Floats) -> Floats:
    """Return the maximum length (D,) over each row of vectors (D, V, 3)."""
    return np.asarray(np.sqrt((vectors * vectors).sum(axis=-1).max(axis=-1)))
