"""Skins → skeletons of UsdSkel: skins whose bind poses agree share one.

A UsdSkelSkeleton has one bind transform per joint; a mesh may have a matrix of its own into that bind space. Two skins
are one skeleton if such a matrix exists, as for the clothes and the body of a character.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.errors import UnsupportedError
from anim.model import MeshInstance, Scene, Skin
from anim.model.skeleton import ancestors
from anim.sampling.pose import rest_world

BIND_TOLERANCE_PER_DIAGONAL = 1e-6  # of the mesh, to its corners: rounding of float32 matrices
IDENTITY_TOLERANCE = 1e-6


@dataclass(slots=True)
class SkeletonGroup:
    """A skeleton, and the mesh instances bound to it.

    anchor: the node below which it is, −1 for none: the nearest one above all joints. joints: node indices, parents
    before children; nodes between joints are joints too. parents: (J,) index of the parent joint, −1 for a root.
    inverse_bind: (4, 4) joint_from_skeleton by node, for joints of skins. members: instances, each with
    mesh-to-skeleton (4, 4) at bind time. Without joints it is for the blend shapes of one unskinned mesh on the anchor.
    """

    anchor: int
    joints: tuple[int, ...] = ()
    parents: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    inverse_bind: dict[int, Floats] = field(default_factory=dict)
    members: list[tuple[MeshInstance, Floats]] = field(default_factory=list)

    def bind_scales(self) -> Floats:
        """Return the scale (J,) of each joint's bind transform, skeleton_from_joint; nan of joints without weight."""
        found = np.full(len(self.joints), np.nan)
        used = set[int]()
        for instance, _ in self.members:
            if instance.skin is None:
                used.add(instance.node)
            else:
                carrying = np.unique(instance.mesh.joints[instance.mesh.weights > 0])
                used.update(instance.skin.joints[carrying].tolist())
        for i, node in enumerate(self.joints):
            if node in used and node in self.inverse_bind:
                found[i] = abs(float(np.linalg.det(self.inverse_bind[node][:3, :3]))) ** (-1 / 3)
        return found


def group_skeletons(
    scene: Scene, instances: Sequence[MeshInstance], animated: Container[int] = ()
) -> list[SkeletonGroup]:
    """Return the skeletons of skinned instances, and one for each other instance with morph targets.

    Unskinned instances below joints are members too, bound to their own node: players move skeletons more reliably than
    prims. animated: nodes that a clip moves; those above joints become joints.
    Raises UnsupportedError for a joint with weight whose inverse bind matrix has no inverse.
    """
    rest = rest_world(scene.skeleton)
    groups: list[SkeletonGroup] = []
    morphed: list[SkeletonGroup] = []
    for instance in instances:
        if instance.skin is None:
            if len(instance.mesh.targets):
                morphed.append(SkeletonGroup(instance.node, members=[(instance, np.eye(4))]))
            continue
        binds = _inverse_binds(instance, instance.skin, scene, rest)
        for group in groups:
            matrix = _matrix_into(group, binds, instance.mesh.positions)
            if matrix is not None:
                break
        else:
            group, matrix = SkeletonGroup(-1), np.eye(4)
            groups.append(group)
        to_skeleton = np.linalg.inv(matrix)
        group.inverse_bind |= {
            node: bind @ to_skeleton for node, bind in binds.items() if node not in group.inverse_bind
        }
        group.members.append((instance, matrix))
    for instance in instances:
        if instance.skin is None and not len(instance.mesh.targets):
            _add_attached(groups, instance, scene, rest)
    for group in groups:
        _join_hierarchy(group, scene, animated)
    return groups + morphed


def _add_attached(groups: Sequence[SkeletonGroup], instance: MeshInstance, scene: Scene, rest: Floats) -> None:
    """Add an unskinned instance to the skeleton with a joint above it, its node being a joint."""
    above = list(ancestors(scene.skeleton.parents, instance.node))
    for group in groups:
        if any(node in group.inverse_bind for node in above):
            world = _homogeneous(rest[instance.node])
            if _are_invertible(world):
                bind = group.inverse_bind.setdefault(instance.node, np.asarray(np.linalg.inv(world), np.float64))
                group.members.append((instance, np.asarray(np.linalg.inv(bind), np.float64)))
            return


def _inverse_binds(instance: MeshInstance, skin: Skin, scene: Scene, rest: Floats) -> dict[int, Floats]:
    """joint_from_mesh (4, 4) by node; of joints without weight, those without an inverse are replaced by the rest.

    rest: (N, 3, 4), world matrices. Of a node that is a joint several times the first matrix counts.
    """
    used = np.unique(instance.mesh.joints[instance.mesh.weights > 0])
    lost = used[~_are_invertible(skin.inverse_bind[used])]
    if len(lost):
        raise UnsupportedError(
            f"the inverse bind matrix of {scene.skeleton.label(int(skin.joints[lost[0]]))} has no inverse, "
            "which USD needs",
            help="optimize and check keep such skins; bake to .usdz has their vertices",
        )
    first: dict[int, int] = {}
    for i, node in enumerate(skin.joints.tolist()):
        first.setdefault(node, i)
    inverse = skin.inverse_bind[[*first.values()]]
    found: dict[int, Floats] = {}
    for node, matrix, is_sound in zip(first, inverse, _are_invertible(inverse).tolist(), strict=True):
        found[node] = _homogeneous(matrix if is_sound else rest[node])
        if not is_sound:
            inverted = np.linalg.inv(found[node]) if _are_invertible(found[node]) else np.eye(4)
            found[node] = np.asarray(inverted, np.float64)
    return found


def _homogeneous(matrix: Floats) -> Floats:
    """The affine matrix (3, 4) as (4, 4)."""
    return np.vstack((matrix, (0, 0, 0, 1)))


def _are_invertible(matrices: Floats) -> Bools:
    """Mask (...) of affine matrices (..., 3 or 4, 4) that have an inverse."""
    singular = np.linalg.svd(matrices[..., :3, :3], compute_uv=False)
    return np.asarray(np.isfinite(matrices).all(axis=(-2, -1)) & (singular[..., -1] > 1e-9 * singular[..., 0]))


def _matrix_into(group: SkeletonGroup, binds: dict[int, Floats], positions: Floats) -> Floats | None:
    """Mesh-to-skeleton (4, 4) for a skin in the bind pose of a group; None if there is none, or no common joint."""
    common = [node for node in binds if node in group.inverse_bind]
    if not common:
        return None
    matrix = np.linalg.inv(group.inverse_bind[common[0]]) @ binds[common[0]]
    if np.abs(matrix - np.eye(4)).max() < IDENTITY_TOLERANCE:
        matrix = np.eye(4)
    low, high = positions.min(axis=0), positions.max(axis=0)
    corners = np.array([(x, y, z, 1) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    limit = BIND_TOLERANCE_PER_DIAGONAL * float(np.linalg.norm(high - low))
    for node in common:
        difference = np.linalg.inv(binds[node]) @ group.inverse_bind[node] @ matrix - np.eye(4)
        if np.linalg.norm((corners @ difference.T)[:, :3], axis=1).max() > limit:
            return None
    return matrix


def _join_hierarchy(group: SkeletonGroup, scene: Scene, animated: Container[int]) -> None:
    """Set the anchor, above which nothing moves, and the joints with their parents from those with a bind."""
    parents = scene.skeleton.parents
    chains = {node: list(ancestors(parents, node)) for node in group.inverse_bind}
    group.anchor = _common_ancestor(list(chains.values()), group.inverse_bind)
    moving = [node for node in (group.anchor, *ancestors(parents, group.anchor)) if node >= 0 and node in animated]
    if moving:
        group.anchor = int(parents[moving[-1]])
    inside = set(chains)
    for chain in chains.values():
        inside.update(chain[: chain.index(group.anchor)] if group.anchor >= 0 else chain)
    order = [node for level in scene.skeleton.levels() for node in level.tolist() if node in inside]
    group.joints = tuple(_depth_first(order, parents))
    number = {node: i for i, node in enumerate(group.joints)}
    group.parents = np.array([number.get(int(parents[node]), -1) for node in group.joints], np.int64)


def _common_ancestor(chains: Sequence[Sequence[int]], joints: Iterable[int]) -> int:
    """The nearest node above all joints that is no joint, −1 for none."""
    own = set(joints)
    common = set(chains[0]).intersection(*chains[1:]) - own
    return next((node for node in chains[0] if node in common), -1)


def _depth_first(order: Sequence[int], parents: Ints) -> list[int]:
    """The nodes, given by level, so that each is followed by its descendants."""
    children: dict[int, list[int]] = {}
    inside = set(order)
    for node in order:
        parent = int(parents[node])
        children.setdefault(parent if parent in inside else -1, []).append(node)
    found, stack = [], children.get(-1, [])[::-1]
    while stack:
        node = stack.pop()
        found.append(node)
        stack.extend(reversed(children.get(node, ())))
    return found
