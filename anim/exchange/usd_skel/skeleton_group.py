"""Skins → skeletons of UsdSkel: skins whose bind poses agree share one.

A UsdSkelSkeleton has one bind transform per joint; a mesh may have a matrix of its own into that bind space. Two skins
are one skeleton if such a matrix exists, as for the clothes and the body of a character.
"""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import dataclass, field

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.errors import UnsupportedError
from anim.exchange.usd_skel.bind_poses import BindPose, BindPoses
from anim.exchange.usd_skel.joint_hierarchy import NodeOrder, join_joints
from anim.model import MeshInstance, Scene, Skin
from anim.sampling.pose import rest_world

MAX_JOINTS = 200_000  # of all skeletons, about 30 µs each


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
    Raises UnsupportedError for a joint with weight whose inverse bind matrix has no inverse, and for too many joints.
    """
    rest = rest_world(scene.skeleton)
    groups: list[SkeletonGroup] = []
    morphed: list[SkeletonGroup] = []
    poses, order = BindPoses(), NodeOrder(scene.skeleton)
    for instance in instances:
        if instance.skin is None:
            if len(instance.mesh.targets):
                morphed.append(SkeletonGroup(instance.node, members=[(instance, np.eye(4))]))
            continue
        binds = _inverse_binds(instance, instance.skin, scene, rest)
        pose = BindPose(binds, instance.mesh.positions)
        for number in poses.candidates(instance.skin):
            group = groups[number]
            matrix = pose.matrix_into(group.inverse_bind)
            if matrix is not None:
                break
        else:
            number, group, matrix = len(groups), SkeletonGroup(-1), np.eye(4)
            groups.append(group)
        poses.add(instance.skin, number)
        to_skeleton = np.linalg.inv(matrix)
        group.inverse_bind |= {
            node: bind @ to_skeleton for node, bind in binds.items() if node not in group.inverse_bind
        }
        group.members.append((instance, matrix))
    above = _groups_above(groups, order)
    for instance in instances:
        first = above[instance.node]
        if instance.skin is None and not len(instance.mesh.targets) and first is not None:
            _add_attached(groups[first], instance, rest)
    num_joints = 0
    for group in groups:
        group.anchor, group.joints, group.parents = join_joints(group.inverse_bind, order, animated)
        num_joints += len(group.joints)
        if num_joints > MAX_JOINTS:
            raise UnsupportedError(
                f"its skeletons have more than {MAX_JOINTS} joints in USD: each has those above its own that move, too",
                help="bake to .usdz has their vertices",
            )
    return groups + morphed


def _groups_above(groups: Sequence[SkeletonGroup], order: NodeOrder) -> list[int | None]:
    """The number of the first skeleton with a joint above each node (N,), None for none."""
    own: dict[int, int] = {}
    for number, group in enumerate(groups):
        for node in group.inverse_bind:
            own.setdefault(node, number)
    found: list[int | None] = [None] * len(order.nodes)
    for node in order.nodes:
        parent = order.parents[node]
        if parent >= 0:
            found[node] = min((each for each in (found[parent], own.get(parent)) if each is not None), default=None)
    return found


def _add_attached(group: SkeletonGroup, instance: MeshInstance, rest: Floats) -> None:
    """Add an unskinned instance below a joint of a skeleton, its node being a joint."""
    world = _homogeneous(rest[instance.node])
    if _are_invertible(world):
        bind = group.inverse_bind.setdefault(instance.node, np.asarray(np.linalg.inv(world), np.float64))
        group.members.append((instance, np.asarray(np.linalg.inv(bind), np.float64)))


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
