"""Pose transfer from a source to a target skeleton, relative to both rest poses, at any time."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, Ints
from anim.errors import RangeError
from anim.exchange.retarget.anchors import NONE, Pair, evaluation_order, find_anchors
from anim.exchange.retarget.joint_matching import JointMatch, match_same_hierarchy
from anim.exchange.retarget.rest_alignment import RestAlignment, align_rests, floor_offset
from anim.exchange.retarget.rest_pose import UP, RestPose, rest_corrections
from anim.maths import hierarchy, matrix, quaternion
from anim.model import Clip, Pose, Skeleton
from anim.model.skeleton import ancestors
from anim.sampling import rest_pose, rest_world, sample_pose, world_matrices
from anim.sampling.world import local_by_node, with_scale_signs, world_by_node, world_rotations

MIN_SCALE_VOLUME = 1e-9  # of a unit cube's volume; a smaller scale flattens an axis
NUM_HEIGHT_SAMPLES = 64  # times at which the height of the motion is sampled


@dataclass(frozen=True, slots=True)
class TargetMotion:
    """The target at times (F,), by node: local rotations (F, 4), translations (F, 3) and scales (F, 3).

    source, world: world matrices (N, F, 3, 4) of both skeletons.
    """

    rotations: dict[int, Floats]
    translations: dict[int, Floats]
    scales: dict[int, Floats]
    source: Floats
    world: Floats


@dataclass(frozen=True, slots=True)
class PoseTransfer:
    """Parameters of a target that follows a source.

    source_rest, target_rest: rest poses, the source's at the bind time. aligned: alignment of both as a whole.
    corrections: by target node, the world rotation (4,) from its rest pose to the source's. anchors: the anchor
    pair of each matched target node. order: the target's nodes in evaluation order. top: the target's topmost joint
    of a person, or of all. lifted: nodes that move vertically with it, independent of their anchors. origin: (N, 3)
    of the source, reference of paths. subtrees: of the source, as of `find_subtrees`.
    """

    source: Skeleton
    clip: Clip
    target: Skeleton
    pairs: Mapping[int, int]
    source_rest: RestPose
    target_rest: RestPose
    aligned: RestAlignment
    corrections: Mapping[int, Floats]
    anchors: Mapping[int, Pair]
    order: tuple[int, ...]
    top: int
    lifted: frozenset[int]
    origin: Floats
    subtrees: tuple[Ints, Ints]

    def at(self, times: Floats, lowered: Floats | None = None) -> TargetMotion:
        """Return the target's motion at times (F,) in seconds, lowered by `lowered` (F,) metres."""
        motion = sample_pose(self.source, self.clip, times)
        source_world = world_by_node(self.source, motion)
        rotations = self._rotations(world_rotations(self.source, motion.rotation))
        scales = {b: self._scale(a, b, motion.scale[:, a]) for a, b in self.pairs.items()}
        rest = rest_pose(self.target)
        local = local_by_node(self.target, _override_rest(rest, len(times), rotations, scales))
        world = self._world_matrices(local, source_world, motion, lowered)
        return TargetMotion(rotations, {b: local[b, :, :, 3] for b in self.pairs.values()}, scales, source_world, world)

    def _rotations(self, source_rotations: Floats) -> dict[int, Floats]:
        """Local rotations (F, 4): world rotations relative to rest as the source's (N, F, 4), after rest correction."""
        rotation, target_world = self.aligned.rotation, dict[int, Floats]()
        for a, b in self.pairs.items():
            change = quaternion.multiply(source_rotations[a], quaternion.conjugate(self.source_rest.rotations[a]))
            change = quaternion.multiply(quaternion.multiply(rotation, change), quaternion.conjugate(rotation))
            target_world[b] = quaternion.multiply(
                change, quaternion.multiply(self.corrections[b], self.target_rest.rotations[b])
            )
        return _local_rotations(self.target, target_world)

    def _scale(self, a: int, b: int, scale: Floats) -> Floats:
        """Local scale (F, 3): the source's relative to rest, along the nearest axes of the target's joint."""
        own = quaternion.multiply(self.corrections[b], self.target_rest.rotations[b])
        other = quaternion.multiply(self.aligned.rotation, self.source_rest.rotations[a])
        axes = quaternion.to_matrix(quaternion.multiply(quaternion.conjugate(own), other))
        rest_scale = self.source_rest.scales[a]
        factor = np.where(rest_scale != 0, scale / np.where(rest_scale != 0, rest_scale, 1.0), scale)
        return np.asarray(self.target.scale[b] * (factor @ (axes * axes).T))

    def _world_matrices(self, local: Floats, source_world: Floats, motion: Pose, lowered: Floats | None) -> Floats:
        """World matrices (N, F, 3, 4) of the target; translations of matched nodes are stored in `local`."""
        source_of = {b: a for a, b in self.pairs.items()}
        world = np.empty_like(local)
        for node in self.order:
            parent = int(self.target.parents[node])
            if node in source_of:
                position = self._path(source_of[node], node, source_world, motion, world)
                if lowered is not None and node in self.lifted:
                    position = position - lowered[:, None] * [0, 1, 0]
                rest_offset = local[node, :, :, 3]
                local[node, :, :, 3] = (
                    position if parent < 0 else _to_parent_space(world[parent], position, rest_offset)
                )
            world[node] = local[node] if parent < 0 else matrix.multiply(world[parent], local[node])
        return world

    def _path(self, a: int, b: int, source_world: Floats, motion: Pose, world: Floats) -> Floats:
        """World positions (F, 3) of a target node.

        From its anchor: the source's offset, scaled and rotated, plus the difference of both rest poses there, which
        rotates with the anchor. For equal rest poses the difference is 0, and the offset is the source's.
        """
        rotation, scale = self.aligned.rotation, self.aligned.scale
        from_a, from_b = self.anchors[b]
        if from_b < 0:
            moved = quaternion.rotate(rotation, source_world[a, :, :, 3] - self.origin[a]) * scale
            return np.asarray(self.target_rest.positions[b] + moved)
        offset = quaternion.rotate(rotation, self._offset(a, from_a, source_world, motion)) * scale
        rest_offset_a = self.source_rest.positions[a] - self.source_rest.positions[from_a]
        rest_offset_b = self.target_rest.positions[b] - self.target_rest.positions[from_b]
        correction = quaternion.conjugate(self.corrections[from_b])
        excess = rest_offset_b - scale * quaternion.rotate(correction, quaternion.rotate(rotation, rest_offset_a))
        excess = quaternion.rotate(quaternion.conjugate(rotation), quaternion.rotate(self.corrections[from_b], excess))
        moved = source_world[from_a, :, :, :3] @ (self.source_rest.to_node[from_a] @ excess)
        return np.asarray(world[from_b, :, :, 3] + offset + quaternion.rotate(rotation, moved))

    def _offset(self, a: int, anchor: int, source_world: Floats, motion: Pose) -> Floats:
        """Offset (F, 3) of a source node from its anchor, in world space.

        Rotations of unmatched nodes between the two are ignored: the target has no joint there.
        """
        if not hierarchy.is_below(self.subtrees, a, anchor):
            return np.asarray(source_world[a, :, :, 3] - source_world[anchor, :, :, 3])
        inside = motion.translation[:, a]
        for node in itertools.takewhile(lambda each: each != anchor, ancestors(self.source.parents, a)):
            inside = motion.translation[:, node] + inside @ self.source_rest.local[node].T
        return np.asarray((source_world[anchor, :, :, :3] @ inside[..., None])[..., 0])


def build_transfer(
    source: Skeleton, clip: Clip, target: Skeleton, matching: JointMatch, *, bind_time: float | None
) -> PoseTransfer:
    """Return the transfer from the source's to the target's matched joints.

    World rotations are transferred relative to the rest pose, between corrected rest poses
    (`rest_pose.rest_corrections`); unmatched nodes of the target keep their own. Each joint keeps its offset from its
    anchor (see `anchors`), and moves relative to it as the source's does, scaled; the topmost follow the source's path
    from their rest positions. Scales are transferred as factors of the rest's. So for equal rest poses, up to a
    similarity transform of the whole, the target's motion equals the source's.
    bind_time: s, time of the source's rest pose; None for the pose with all angles zero. Raises RangeError for a time
    outside the clip.
    """
    if bind_time is not None and not clip.start <= bind_time <= clip.end:
        raise RangeError(
            f"bind time {bind_time:g} s is outside the motion (expected {clip.start:g} to {clip.end:.4g} s)"
        )
    source_pose = rest_pose(source) if bind_time is None else sample_pose(source, clip, np.array([bind_time]))
    source_rest, target_rest = _rest_pose(source, source_pose), _rest_pose(target, rest_pose(target))
    of_one_tree = not matching.unmatched and bool(match_same_hierarchy(source, target, [*matching.pairs]))
    aligned = align_rests(source_rest, target_rest, matching, of_one_tree=of_one_tree)
    chosen = find_anchors(source, target, matching.pairs)
    order = evaluation_order(target, chosen, matching.pairs)
    source_top, top = _find_topmost(source, matching)
    return PoseTransfer(
        source=source,
        clip=clip,
        target=target,
        pairs=matching.pairs,
        source_rest=source_rest,
        target_rest=target_rest,
        aligned=aligned,
        corrections=rest_corrections(source_rest, target_rest, matching, aligned.rotation),
        anchors=chosen,
        order=tuple(order),
        top=top,
        lifted=_lifted_nodes(chosen, top),
        origin=_origin(source, clip, target_rest, source_top),
        subtrees=hierarchy.find_subtrees(source.parents),
    )


def _rest_pose(skeleton: Skeleton, pose: Pose) -> RestPose:
    world = world_matrices(skeleton, pose)[0]
    return RestPose(
        world[:, :, 3],
        world_rotations(skeleton, pose.rotation)[:, 0],
        tuple(skeleton.parents.tolist()),
        pose.scale[0],
        local_by_node(skeleton, pose)[:, 0, :, :3],
        matrix.inverse(world)[:, :, :3],
    )


def _to_parent_space(parent: Floats, position: Floats, rest: Floats) -> Floats:
    """World positions (F, 3) in a parent's space; rest values (F, 3) along axes flattened by its scale."""
    linear, offset = parent[:, :, :3], position - matrix.apply(parent, rest[:, None])[:, 0]
    largest = np.sqrt((linear * linear).sum(axis=-2)).max(axis=-1)
    flat = np.abs(np.linalg.det(linear)) <= MIN_SCALE_VOLUME * largest**3
    inverse = np.empty_like(linear)
    inverse[~flat], inverse[flat] = np.linalg.inv(linear[~flat]), np.linalg.pinv(linear[flat], rcond=MIN_SCALE_VOLUME)
    return np.asarray(rest + (inverse @ offset[..., None])[..., 0])


def _override_rest(rest: Pose, frames: int, rotations: Mapping[int, Floats], scales: Mapping[int, Floats]) -> Pose:
    """A rest pose for many frames, with other rotations and scales of some nodes."""
    rotation, scale = np.repeat(rest.rotation, frames, axis=0), np.repeat(rest.scale, frames, axis=0)
    for node, values in rotations.items():
        rotation[:, node] = values
    for node, values in scales.items():
        scale[:, node] = values
    return Pose(np.zeros(frames), np.repeat(rest.translation, frames, axis=0), rotation, scale)


def _local_rotations(skeleton: Skeleton, target_world: dict[int, Floats]) -> dict[int, Floats]:
    """Local rotations (F, 4) of the nodes with given world rotations; the others remain at rest."""
    world: dict[int, Floats] = {}
    found: dict[int, Floats] = {}
    for level in skeleton.levels():
        for node in level.tolist():
            parent = int(skeleton.parents[node])
            parent_world = with_scale_signs(skeleton, parent, world) if parent >= 0 else None
            if node in target_world:
                world[node] = target_world[node]
                found[node] = (
                    target_world[node]
                    if parent_world is None
                    else quaternion.normalize(
                        quaternion.multiply(quaternion.conjugate(parent_world), target_world[node])
                    )
                )
            else:
                own = skeleton.rotation[node]
                world[node] = own if parent_world is None else quaternion.multiply(parent_world, own)
    return found


def _origin(source: Skeleton, clip: Clip, target: RestPose, top: int) -> Floats:
    """Positions (N, 3) of the source's nodes at rest, with feet on the floor."""
    at_rest = rest_world(source)[:, :, 3]
    times = np.linspace(clip.start, clip.end, NUM_HEIGHT_SAMPLES)
    heights = world_by_node(source, sample_pose(source, clip, times))[top, :, 1, 3]
    return at_rest + floor_offset(at_rest, target.positions, heights, top) * UP


def _lifted_nodes(chosen: Mapping[int, Pair], top: int) -> frozenset[int]:
    """The topmost joint and nodes with an anchor above it: moved by the floor, unlike the anchors."""
    chain, node = [-1], top
    while (node := chosen.get(node, NONE)[1]) >= 0:
        chain.append(node)
    return frozenset(node for node, (_, anchor) in chosen.items() if anchor in chain and node not in chain)


def _find_topmost(source: Skeleton, matching: JointMatch) -> tuple[int, int]:
    """The hips, or the matched source node nearest to the root, and its partner."""
    if "hips" in matching.source_roles:
        return matching.source_roles["hips"], matching.target_roles["hips"]
    for level in source.levels():
        for node in level.tolist():
            if node in matching.pairs:
                return node, matching.pairs[node]
    raise AssertionError
