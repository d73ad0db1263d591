"""Pose transfer from a source to a target skeleton, relative to both rest poses, at any time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.errors import RangeError
from anim.exchange.retarget.anchors import NONE, Pair, evaluation_order, find_anchors
from anim.exchange.retarget.joint_matching import JointMatch, match_same_hierarchy
from anim.exchange.retarget.rest_alignment import RestAlignment, align_rests, floor_offset
from anim.exchange.retarget.rest_pose import UP, RestPose, rest_corrections
from anim.maths import matrix, quaternion
from anim.model import Clip, Pose, Skeleton
from anim.model.skeleton import ancestors
from anim.sampling import rest_pose, rest_world, world_matrices
from anim.sampling import sample_pose as posed
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

    aligned: alignment of the whole rest poses. fixes: by target node, the world rotation (4,) from its rest pose to the
    source's. anchors: the anchor pair of each matched target node. order: the target's nodes in evaluation order. top:
    the target's topmost joint of a person, or of all. lifted: nodes that move vertically with it, independent of their
    anchors. origin: (N, 3) of the source, reference of paths.
    """

    source: Skeleton
    clip: Clip
    target: Skeleton
    pairs: Mapping[int, int]
    of_source: RestPose
    at_rest: RestPose
    aligned: RestAlignment
    fixes: Mapping[int, Floats]
    anchors: Mapping[int, Pair]
    order: tuple[int, ...]
    top: int
    lifted: frozenset[int]
    origin: Floats

    def at(self, times: Floats, lowered: Floats | None = None) -> TargetMotion:
        """Return the target's motion at times (F,) in seconds, lowered by `lowered` (F,) metres."""
        motion = posed(self.source, self.clip, times)
        of_source = world_by_node(self.source, motion)
        rotations = self._rotations(world_rotations(self.source, motion.rotation))
        scales = {b: self._scale(a, b, motion.scale[:, a]) for a, b in self.pairs.items()}
        still = rest_pose(self.target)
        local = local_by_node(self.target, _override_rest(still, len(times), rotations, scales))
        world = self._place(local, of_source, motion, lowered)
        return TargetMotion(rotations, {b: local[b, :, :, 3] for b in self.pairs.values()}, scales, of_source, world)

    def _rotations(self, of_source: dict[int, Floats]) -> dict[int, Floats]:
        """Local rotations (F, 4): world rotations relative to rest as the source's, after rest correction."""
        turn, wanted = self.aligned.rotation, dict[int, Floats]()
        for a, b in self.pairs.items():
            moved = quaternion.multiply(of_source[a], quaternion.conjugate(self.of_source.rotations[a]))
            moved = quaternion.multiply(quaternion.multiply(turn, moved), quaternion.conjugate(turn))
            wanted[b] = quaternion.multiply(moved, quaternion.multiply(self.fixes[b], self.at_rest.rotations[b]))
        return _local_rotations(self.target, wanted)

    def _scale(self, a: int, b: int, scale: Floats) -> Floats:
        """Local scale (F, 3): the source's relative to rest, along the nearest axes of the target's joint."""
        own = quaternion.multiply(self.fixes[b], self.at_rest.rotations[b])
        other = quaternion.multiply(self.aligned.rotation, self.of_source.rotations[a])
        axes = quaternion.to_matrix(quaternion.multiply(quaternion.conjugate(own), other))
        still = self.of_source.scales[a]
        factor = np.where(still != 0, scale / np.where(still != 0, still, 1.0), scale)
        return np.asarray(self.target.scale[b] * (factor @ (axes * axes).T))

    def _place(self, local: Floats, of_source: Floats, motion: Pose, lowered: Floats | None) -> Floats:
        """World matrices (N, F, 3, 4) of the target; translations of matched nodes are stored in `local`."""
        back = {b: a for a, b in self.pairs.items()}
        world = np.empty_like(local)
        for node in self.order:
            parent = int(self.target.parents[node])
            if node in back:
                place = self._path(back[node], node, of_source, motion, world)
                if lowered is not None and node in self.lifted:
                    place = place - lowered[:, None] * [0, 1, 0]
                still = local[node, :, :, 3]
                local[node, :, :, 3] = place if parent < 0 else _to_parent_space(world[parent], place, still)
            world[node] = local[node] if parent < 0 else matrix.multiply(world[parent], local[node])
        return world

    def _path(self, a: int, b: int, of_source: Floats, motion: Pose, world: Floats) -> Floats:
        """World positions (F, 3) of a target node.

        From its anchor: the source's offset, scaled and rotated, plus the difference of both rest poses there, which
        rotates with the anchor. For equal rest poses the difference is 0, and the offset is the source's.
        """
        turn, scale = self.aligned.rotation, self.aligned.scale
        from_a, from_b = self.anchors[b]
        if from_b < 0:
            moved = quaternion.rotate(turn, of_source[a, :, :, 3] - self.origin[a]) * scale
            return np.asarray(self.at_rest.positions[b] + moved)
        offset = quaternion.rotate(turn, self._offset(a, from_a, of_source, motion)) * scale
        still_a = self.of_source.positions[a] - self.of_source.positions[from_a]
        still_b = self.at_rest.positions[b] - self.at_rest.positions[from_b]
        fix = quaternion.conjugate(self.fixes[from_b])
        excess = still_b - scale * quaternion.rotate(fix, quaternion.rotate(turn, still_a))
        excess = quaternion.rotate(quaternion.conjugate(turn), quaternion.rotate(self.fixes[from_b], excess))
        moved = of_source[from_a, :, :, :3] @ (self.of_source.to_node[from_a] @ excess)
        return np.asarray(world[from_b, :, :, 3] + offset + quaternion.rotate(turn, moved))

    def _offset(self, a: int, anchor: int, of_source: Floats, motion: Pose) -> Floats:
        """Offset (F, 3) of a source node from its anchor, in world space.

        Rotations of unmatched nodes between the two are ignored: the target has no joint there.
        """
        between = [*ancestors(self.source.parents, a)]
        if anchor not in between:
            return np.asarray(of_source[a, :, :, 3] - of_source[anchor, :, :, 3])
        inside = motion.translation[:, a]
        for node in between[: between.index(anchor)]:
            inside = motion.translation[:, node] + inside @ self.of_source.local[node].T
        return np.asarray((of_source[anchor, :, :, :3] @ inside[..., None])[..., 0])


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
    still = rest_pose(source) if bind_time is None else posed(source, clip, np.array([bind_time]))
    of_source, at_rest = _rest_pose(source, still), _rest_pose(target, rest_pose(target))
    of_one_tree = not matching.unmatched and bool(match_same_hierarchy(source, target, [*matching.pairs]))
    aligned = align_rests(of_source, at_rest, matching, of_one_tree=of_one_tree)
    chosen = find_anchors(source, target, matching.pairs)
    order = evaluation_order(target, chosen, matching.pairs)
    top_of_source, top = _find_topmost(source, matching)
    return PoseTransfer(
        source=source,
        clip=clip,
        target=target,
        pairs=matching.pairs,
        of_source=of_source,
        at_rest=at_rest,
        aligned=aligned,
        fixes=rest_corrections(of_source, at_rest, matching, aligned.rotation),
        anchors=chosen,
        order=tuple(order),
        top=top,
        lifted=_lifted_nodes(chosen, top),
        origin=_origin(source, clip, at_rest, top_of_source),
    )


def _rest_pose(skeleton: Skeleton, still: Pose) -> RestPose:
    world = world_matrices(skeleton, still)[0]
    rotations = world_rotations(skeleton, still.rotation)
    return RestPose(
        world[:, :, 3],
        np.array([rotations[node][0] for node in range(len(skeleton))]),
        tuple(skeleton.parents.tolist()),
        still.scale[0],
        local_by_node(skeleton, still)[:, 0, :, :3],
        matrix.inverse(world)[:, :, :3],
    )


def _to_parent_space(parent: Floats, place: Floats, still: Floats) -> Floats:
    """World positions (F, 3) in a parent's space; rest values (F, 3) along axes flattened by its scale."""
    linear, beyond = parent[:, :, :3], place - matrix.apply(parent, still[:, None])[:, 0]
    largest = np.sqrt((linear * linear).sum(axis=-2)).max(axis=-1)
    flat = np.abs(np.linalg.det(linear)) <= MIN_SCALE_VOLUME * largest**3
    back = np.empty_like(linear)
    back[~flat], back[flat] = np.linalg.inv(linear[~flat]), np.linalg.pinv(linear[flat], rcond=MIN_SCALE_VOLUME)
    return np.asarray(still + (back @ beyond[..., None])[..., 0])


def _override_rest(still: Pose, frames: int, rotations: Mapping[int, Floats], scales: Mapping[int, Floats]) -> Pose:
    """A rest pose for many frames, with other rotations and scales of some nodes."""
    rotation, scale = np.repeat(still.rotation, frames, axis=0), np.repeat(still.scale, frames, axis=0)
    for node, values in rotations.items():
        rotation[:, node] = values
    for node, values in scales.items():
        scale[:, node] = values
    return Pose(np.zeros(frames), np.repeat(still.translation, frames, axis=0), rotation, scale)


def _local_rotations(skeleton: Skeleton, wanted: dict[int, Floats]) -> dict[int, Floats]:
    """Local rotations (F, 4) of the nodes with given world rotations; the others remain at rest."""
    world: dict[int, Floats] = {}
    found: dict[int, Floats] = {}
    for level in skeleton.levels():
        for node in level.tolist():
            parent = int(skeleton.parents[node])
            parent_world = with_scale_signs(skeleton, parent, world) if parent >= 0 else None
            if node in wanted:
                world[node] = wanted[node]
                found[node] = (
                    wanted[node]
                    if parent_world is None
                    else quaternion.normalize(quaternion.multiply(quaternion.conjugate(parent_world), wanted[node]))
                )
            else:
                own = skeleton.rotation[node]
                world[node] = own if parent_world is None else quaternion.multiply(parent_world, own)
    return found


def _origin(source: Skeleton, clip: Clip, target: RestPose, top: int) -> Floats:
    """Positions (N, 3) of the source's nodes at rest, with feet on the floor."""
    at_rest = rest_world(source)[:, :, 3]
    looks = np.linspace(clip.start, clip.end, NUM_HEIGHT_SAMPLES)
    heights = world_by_node(source, posed(source, clip, looks))[top, :, 1, 3]
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
