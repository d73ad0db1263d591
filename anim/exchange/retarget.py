"""A motion put on another skeleton: joints turn in world space as the source's do, seen from both rest poses."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from anim.arrays import Floats, sorted_unique
from anim.errors import NotFoundError, RangeError
from anim.exchange import between
from anim.exchange.floor import at_or_below, heights_above_contact, soles
from anim.exchange.from_euler import Converted
from anim.exchange.match import Matching
from anim.exchange.strays import with_strays
from anim.exchange.transfer import Transfer, transfer
from anim.maths import matrix, quaternion
from anim.model import Clip, Interpolation, Scene, Skeleton, Track
from anim.sampling import pose as posed
from anim.sampling import rest, world_matrices

LONGEST = 86_400.0  # s; of a motion that is looked through for contacts, 30 times a second and more
CONTACT_STEP = 1 / 30  # s between times at which soles are looked at, where keys stand farther apart


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
    source: Converted,
    target: Scene,
    matching: Matching,
    *,
    floor: Floor = Floor.CONTACT,
    rest_at: float | None = None,
) -> Retargeted:
    """Return a clip that moves the target's matched joints as the source's move; see `transfer` for how.

    Keys stand at all times of the source, and between them where what a player makes there would leave the motion by
    more than the source's tolerance, of the target's size for its path; recordings keep their grid.
    floor: CONTACT moves the hips up or down so that the soles stand where they stand at rest while a foot of the
    source is down; KEEP scales heights only. rest_at: s, the time at which the source stands in its rest pose; None
    for the pose in which every angle is zero.
    Raises NotFoundError where no joint is matched, RangeError for CONTACT in a motion of over a day.
    """
    if not matching.pairs:
        raise NotFoundError("no joint of the motion is one of the character", help="name them in an --alias file")
    if floor == Floor.CONTACT and source.clip.end - source.clip.start > LONGEST:
        seconds = source.clip.end - source.clip.start
        raise RangeError(f"the motion lasts {seconds:g} s: too long to see when feet are down", help="--floor keep")
    follow = transfer(source.skeleton, source.clip, target.skeleton, matching, rest_at=rest_at)
    times = _times(source.clip)
    looked_at, lowered = times, np.zeros(len(times))
    if floor == Floor.CONTACT:
        looked_at = times if source.tolerance is None else _no_farther(times, CONTACT_STEP)
        lowered = _too_high(follow, target, matching, looked_at)

    def at(when: Floats) -> tuple[dict[int, Floats], Floats]:
        found = follow.at(when)
        return found.rotations, found.path - np.interp(when, looked_at, lowered)[:, None] * [0, 1, 0]

    if source.tolerance is not None:
        size = float(np.ptp(follow.at_rest.positions, axis=0).max()) or 1.0
        times = between.refined(times, at, tolerance=source.tolerance, size=size)
    rotations, path = at(times)
    clip = _clip(source.clip.name, follow, times, rotations, path)
    return Retargeted(clip, follow.scale, (float(lowered.min()), float(lowered.max())))


def _times(clip: Clip) -> Floats:
    """All key times; where a step jumps, also the float32 time just before: the target's tracks are straight."""
    arrays = {id(track.times): track.times for track in clip.tracks}
    steps = {id(t.times): t.times[1:] for t in clip.tracks if t.interpolation is Interpolation.STEP}
    before = [np.nextafter(each.astype(np.float32), np.float32(0)).astype(np.float64) for each in steps.values()]
    return sorted_unique(np.concatenate([*arrays.values(), *before]))


def _no_farther(times: Floats, step: float) -> Floats:
    """Times with others between them so that none is farther from the next than `step`."""
    grid = np.arange(times[0], times[-1], step)
    return sorted_unique(np.concatenate((times, grid)))


def _too_high(follow: Transfer, target: Scene, matching: Matching, times: Floats) -> Floats:
    """How far (F,) above the floor the target would be with heights scaled only, in metres."""
    found = follow.at(times)
    clip = _clip("", follow, times, found.rotations, found.path)
    world = world_matrices(target.skeleton, posed(target.skeleton, clip, times))
    feet = soles(target, follow.at_rest.positions, [*matching.target_roles.items()])
    roles = matching.source_roles
    of_source = [at_or_below(follow.source, {roles[f]}) for f in ("left_foot", "right_foot") if f in roles]
    return heights_above_contact(times, found.heights, of_source, feet.heights(world), feet.floor, follow.scale)


def _clip(name: str, follow: Transfer, times: Floats, rotations: dict[int, Floats], path: Floats) -> Clip:
    tracks = [_track(node, "rotation", times, quaternion.align_signs(q)) for node, q in sorted(rotations.items())]
    return with_strays(Clip(name, (*tracks, _path_track(follow.target, follow.top, times, path))), follow, times)


def _path_track(skeleton: Skeleton, node: int, times: Floats, path: Floats) -> Track:
    """The local translation that puts a node on a path (F, 3) in world space; what is above it rests."""
    parent = int(skeleton.parents[node])
    if parent >= 0:
        above = world_matrices(skeleton, rest(skeleton))[0, parent]
        path = matrix.apply(matrix.inverse(above), path)
    return _track(node, "translation", times, path)


def _track(node: int, path: str, times: Floats, values: Floats) -> Track:
    return Track(node, path, Interpolation.LINEAR, times, values)
