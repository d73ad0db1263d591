"""A motion put on another skeleton: joints turn in world space as the source's do, seen from both rest poses."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from anim.arrays import Floats, sorted_unique
from anim.errors import NotFoundError
from anim.exchange.floor import heights_above_contact, soles
from anim.exchange.from_euler import Converted
from anim.exchange.match import Matching
from anim.exchange.rest_pose import RestPose, corrections, facing
from anim.exchange.turns import world_rotations
from anim.maths import matrix, quaternion
from anim.model import Clip, Interpolation, Pose, Scene, Skeleton, Track
from anim.sampling import pose as posed
from anim.sampling import rest, world_matrices


class Floor(StrEnum):
    """What heights the hips get."""

    CONTACT = "contact"
    KEEP = "keep"


@dataclass(frozen=True, slots=True)
class Retargeted:
    """The clip for the target, the target's size by the source's, and the least and most that hips went down, in m."""

    clip: Clip
    scale: float
    lowered: tuple[float, float]


def retarget(
    source: Converted, target: Scene, matching: Matching, *, floor: Floor = Floor.CONTACT, rest_at: float | None = None
) -> Retargeted:
    """Return a clip that moves the target's matched joints as the source's move; keys at all times of the source.

    World rotations are taken over as turns away from the rest pose, between rest poses that are made to agree
    (`rest_pose.corrections`); the rest of the target keeps its own. The topmost matched joint follows the source's
    path, scaled by the length of the legs (of the whole where there are none); other joints keep their offsets.

    floor: CONTACT moves the hips up or down so that the soles stand where they stand at rest while a foot of the
    source is down; KEEP scales heights only. rest_at: s, the time at which the source stands in its rest pose; None
    for the pose in which every angle is zero.
    Raises NotFoundError where no joint is matched.
    """
    if not matching.pairs:
        raise NotFoundError("no joint of the motion is one of the character", help="name them in an --alias file")
    times = _times(source.clip)
    motion = posed(source.skeleton, source.clip, times)
    still = rest(source.skeleton) if rest_at is None else posed(source.skeleton, source.clip, np.array([rest_at]))
    of_source = _rest_pose(source.skeleton, still)
    of_target = _rest_pose(target.skeleton, rest(target.skeleton))
    turn = facing(of_source, of_target, matching)
    fixes = corrections(of_source, of_target, matching, turn)
    rotations = world_rotations(source.skeleton, motion.rotation)
    wanted: dict[int, Floats] = {}
    for a, b in matching.pairs.items():
        turned = quaternion.multiply(rotations[a], quaternion.conjugate(of_source.rotations[a]))
        turned = quaternion.multiply(quaternion.multiply(turn, turned), quaternion.conjugate(turn))
        wanted[b] = quaternion.multiply(turned, quaternion.multiply(fixes[b], of_target.rotations[b]))
    locals_ = _local_rotations(target.skeleton, wanted)
    scale = _size(of_target, matching.target_roles, [*matching.pairs.values()]) / _size(
        of_source, matching.source_roles, [*matching.pairs]
    )
    top_source, top = _topmost(source.skeleton, matching)
    places = world_matrices(source.skeleton, motion)[:, :, :, 3]
    path = quaternion.rotate(turn, places[:, top_source]) * scale
    path = path + of_target.positions[top] * [1, 0, 1]
    lowered = np.zeros(len(times))
    tracks = [_track(node, "rotation", times, quaternion.align_signs(q)) for node, q in sorted(locals_.items())]
    clip = Clip(source.clip.name, (*tracks, _path_track(target.skeleton, top, times, path)))
    if floor == Floor.CONTACT:
        world = world_matrices(target.skeleton, posed(target.skeleton, clip, times))
        feet = soles(target, of_target.positions, [*matching.target_roles.items()])
        lowered = heights_above_contact(times, places[:, :, 1], feet.heights(world), feet.floor, scale)
        path = path - lowered[:, None] * [0, 1, 0]
        clip = Clip(source.clip.name, (*tracks, _path_track(target.skeleton, top, times, path)))
    return Retargeted(clip, scale, (float(lowered.min()), float(lowered.max())))


def _times(clip: Clip) -> Floats:
    arrays = {id(track.times): track.times for track in clip.tracks}
    return sorted_unique(np.concatenate([*arrays.values()]))


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


def _size(pose: RestPose, roles: object, nodes: list[int]) -> float:
    """Length of the legs, or how far the nodes lie around their middle."""
    assert isinstance(roles, dict)
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


def _path_track(skeleton: Skeleton, node: int, times: Floats, path: Floats) -> Track:
    """The local translation that puts a node on a path (F, 3) in world space; what is above it rests."""
    parent = int(skeleton.parents[node])
    if parent >= 0:
        above = np.eye(4)
        above[:3] = world_matrices(skeleton, rest(skeleton))[0, parent]
        inverse: Floats = np.linalg.inv(above)[:3].astype(np.float64)
        path = matrix.apply(inverse, path)
    return _track(node, "translation", times, path)


def _track(node: int, path: str, times: Floats, values: Floats) -> Track:
    return Track(node, path, Interpolation.LINEAR, times, values)
