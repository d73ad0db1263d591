"""What another skeleton does at any time while a motion plays: world rotations taken over between two rest poses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.errors import RangeError
from anim.exchange.match import Matching
from anim.exchange.rest_pose import RestPose, corrections, facing
from anim.exchange.turns import world_rotations
from anim.maths import quaternion
from anim.model import Clip, Pose, Skeleton
from anim.sampling import pose as posed
from anim.sampling import rest, world_matrices


@dataclass(frozen=True, slots=True)
class Followed:
    """The target at times (F,): local rotations (F, 4) by node; the world path (F, 3) of its topmost joint.

    heights: (F, N) of the source's nodes.
    """

    rotations: dict[int, Floats]
    path: Floats
    heights: Floats


@dataclass(frozen=True, slots=True)
class Transfer:
    """How a target follows a source.

    scale: of lengths, target by source. top: the target's topmost matched joint, which carries the path.
    at_rest: the target's rest pose.
    """

    source: Skeleton
    clip: Clip
    target: Skeleton
    pairs: Mapping[int, int]
    of_source: RestPose
    at_rest: RestPose
    turn: Floats
    fixes: Mapping[int, Floats]
    scale: float
    top_of_source: int
    top: int

    def at(self, times: Floats) -> Followed:
        """Return what the target does at times (F,) in seconds."""
        motion = posed(self.source, self.clip, times)
        rotations, back = world_rotations(self.source, motion.rotation), quaternion.conjugate(self.turn)
        wanted: dict[int, Floats] = {}
        for a, b in self.pairs.items():
            turned = quaternion.multiply(rotations[a], quaternion.conjugate(self.of_source.rotations[a]))
            turned = quaternion.multiply(quaternion.multiply(self.turn, turned), back)
            wanted[b] = quaternion.multiply(turned, quaternion.multiply(self.fixes[b], self.at_rest.rotations[b]))
        places = world_matrices(self.source, motion)[:, :, :, 3]
        path = quaternion.rotate(self.turn, places[:, self.top_of_source]) * self.scale
        path = path + self.at_rest.positions[self.top] * [1, 0, 1]
        return Followed(_local_rotations(self.target, wanted), path, places[:, :, 1])


def transfer(source: Skeleton, clip: Clip, target: Skeleton, matching: Matching, *, rest_at: float | None) -> Transfer:
    """Return how the target's matched joints follow the source's.

    World rotations are taken over as turns away from the rest pose, between rest poses that are made to agree
    (`rest_pose.corrections`); the rest of the target keeps its own. The topmost matched joint follows the source's
    path, scaled by the length of the legs (of the whole where there are none); other joints keep their offsets.
    rest_at: s, when the source stands in its rest pose; None for the pose in which every angle is zero. Raises
    RangeError where the clip is not running then.
    """
    if rest_at is not None and not clip.start <= rest_at <= clip.end:
        raise RangeError(f"rest at {rest_at:g} s (the motion runs from {clip.start:g} to {clip.end:.4g} s)")
    still = rest(source) if rest_at is None else posed(source, clip, np.array([rest_at]))
    of_source, at_rest = _rest_pose(source, still), _rest_pose(target, rest(target))
    turn = facing(of_source, at_rest, matching)
    fixes = corrections(of_source, at_rest, matching, turn)
    size = _size(at_rest, matching.target_roles, [*matching.pairs.values()])
    scale = size / _size(of_source, matching.source_roles, [*matching.pairs])
    top_of_source, top = _topmost(source, matching)
    return Transfer(source, clip, target, matching.pairs, of_source, at_rest, turn, fixes, scale, top_of_source, top)


def _rest_pose(skeleton: Skeleton, still: Pose) -> RestPose:
    world = world_matrices(skeleton, still)[0]
    rotations = world_rotations(skeleton, still.rotation)
    return RestPose(
        world[:, :, 3],
        np.array([rotations[node][0] for node in range(len(skeleton))]),
        tuple(skeleton.parents.tolist()),
    )


def _local_rotations(skeleton: Skeleton, wanted: dict[int, Floats]) -> dict[int, Floats]:
    """Local rotations (F, 4) of the nodes whose world rotations are wanted; the others stay at rest."""
    world: dict[int, Floats] = {}
    found: dict[int, Floats] = {}
    for level in skeleton.levels():
        for node in level.tolist():
            parent = int(skeleton.parents[node])
            if node in wanted:
                world[node] = wanted[node]
                above = world[parent] if parent >= 0 else None
                found[node] = (
                    wanted[node]
                    if above is None
                    else quaternion.normalize(quaternion.multiply(quaternion.conjugate(above), wanted[node]))
                )
            else:
                own = skeleton.rotation[node]
                world[node] = own if parent < 0 else quaternion.multiply(world[parent], own)
    return found


def _size(pose: RestPose, roles: Mapping[str, int], nodes: list[int]) -> float:
    """Length of the legs, or how far the nodes lie around their middle."""
    legs = []
    for side in ("left", "right"):
        joints = [roles.get(f"{side}_{role}") for role in ("upper_leg", "lower_leg", "foot")]
        if all(joint is not None for joint in joints):
            places = pose.positions[np.array(joints, np.int64)]
            legs.append(float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum()))
    around = pose.positions[nodes] - pose.positions[nodes].mean(axis=0)
    size = float(np.mean(legs)) if legs else float(np.sqrt((around**2).sum(axis=1).mean()))
    return size or 1.0


def _topmost(skeleton: Skeleton, matching: Matching) -> tuple[int, int]:
    """The pair that carries the path: the hips, or the matched source node nearest to the root."""
    if "hips" in matching.source_roles:
        return matching.source_roles["hips"], matching.target_roles["hips"]
    for level in skeleton.levels():
        for node in level.tolist():
            if node in matching.pairs:
                return node, matching.pairs[node]
    raise AssertionError
