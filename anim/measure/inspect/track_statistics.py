"""What a track's keys tell about it: does it move anything, which keys say nothing, which steps are dangerous."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.maths import hermite, quaternion
from anim.measure.inspect.redundant_keys import redundant_keys
from anim.model import Interpolation, Skeleton, Track, ValueKind
from anim.sampling.concatenation import ConcatenatedTracks, concatenate

FLOAT32 = 2.0**-22  # relative; twice the spacing of float32, within which two stored values are the same
REDUNDANT = 1e-6  # of a track's range: a key this close to what its neighbors give says nothing
UNIT = 1e-3  # a quaternion whose length is further off 1 than this was not meant
UNIT_BYTE = 0.00769  # the same for quaternions in normalized bytes, by the Khronos validator
STEPS = {5120: 127, 5121: 255, 5122: 32767, 5123: 65535}  # from 0 to 1, of normalized integers by component type
WIDE_STEP = np.radians(170.0)  # rad; from here on players disagree about which way round is shorter


@dataclass(frozen=True, slots=True)
class TrackStats:
    """Facts about T tracks; arrays (T,).

    constant: never changes. no_effect: constant, and the node rests there anyway. redundant: keys that could go and
    save bytes by that (see `removable`): the steps between those that stay are not wide, and players that don't
    normalize rotations show the same. Of constants one stays, of splines two.
    non_unit, flips, wide: keys with a length off 1, sign changes from key to key (not under STEP), steps of 170° or
    more (under LINEAR alone), of rotations.
    widest: largest step in rad.
    """

    constant: Bools
    no_effect: Bools
    redundant: Ints
    non_unit: Ints
    flips: Ints
    wide: Ints
    widest: Floats

    def __getitem__(self, part: slice) -> TrackStats:
        """Return the facts about some of the tracks."""
        return TrackStats(*(getattr(self, each.name)[part] for each in fields(self)))


def stats(groups: Sequence[ConcatenatedTracks], skeleton: Skeleton) -> TrackStats:
    """Return the facts about tracks that were `joined`, in the order that they had before."""
    result, masks = _all_stats(groups, skeleton)
    result.redundant[:] += np.array([np.count_nonzero(mask) for mask in masks], np.int64)
    return result


def removable_keys(tracks: Sequence[Track], skeleton: Skeleton) -> list[Bools]:
    """Return which keys (K,) of each track could go and save bytes by that, for tracks that move; none of constants.

    (keys at 0, 1, 2 s with the values 0, 5, 10) → [False, True, False]
    """
    return _all_stats(concatenate(tracks), skeleton)[1]


def non_unit_keys(tracks: Sequence[Track]) -> list[int]:
    """Return how many keys of each track are rotations off unit length, beyond what their storage excuses."""
    found = [0] * len(tracks)
    turning = [i for i, track in enumerate(tracks) if track.kind is ValueKind.ROTATION]
    if not turning:
        return found
    chosen = [tracks[i] for i in turning]
    counts = [len(track.times) for track in chosen]
    values = np.concatenate([track.values for track in chosen])
    off = _unit_error(np.sqrt(quaternion.dot(values, values)), chosen, counts)
    for i, sum_of_track in zip(turning, np.add.reduceat(off, np.cumsum([0, *counts[:-1]]), dtype=int), strict=True):
        found[i] = int(sum_of_track)
    return found


def _unit_error(lengths: Floats, tracks: Sequence[Track], counts: Ints | list[int]) -> Bools:
    """Which of all keys' lengths (S,) are off 1 by more than is usual for how their tracks are stored."""
    bytes_only = np.array([track.storage.component_type in (5120, 5121) for track in tracks])
    return np.asarray(np.abs(lengths - 1) > np.repeat(np.where(bytes_only, UNIT_BYTE, UNIT), counts))


def _all_stats(groups: Sequence[ConcatenatedTracks], skeleton: Skeleton) -> tuple[TrackStats, list[Bools]]:
    """The facts, with redundant keys of constants only, and which keys of all other tracks are redundant."""
    count = sum(len(group.tracks) for group in groups)
    result = TrackStats(*(np.zeros(count, kind) for kind in (bool, bool, int, int, int, int, float)))
    tracks: dict[int, Track] = {}
    given: dict[int, Bools] = {}
    for group in groups:
        _count(group, skeleton, result, given)
        tracks.update(zip(group.numbers.tolist(), group.tracks, strict=True))
    return result, redundant_keys([tracks[i] for i in range(count)], given)


def _count(group: ConcatenatedTracks, skeleton: Skeleton, result: TrackStats, given: dict[int, Bools]) -> None:
    """Put the facts about a group into `result`, and which keys of tracks that move could go into `given`."""
    values = group.values
    if group.kind is ValueKind.ROTATION:
        values = _step_angles(group, result)
    constant = _same_values(group, values)
    result.constant[group.numbers] = constant
    result.no_effect[group.numbers] = _at_rest(group, constant, skeleton)
    fewest = 1 if group.tangents is None else 2
    result.redundant[group.numbers] = np.where(constant, np.maximum(group.counts - fewest, 0), 0)
    mask = _redundant(group, values, constant)
    for i in np.flatnonzero(~constant).tolist():
        given[int(group.numbers[i])] = mask[group.starts[i] : group.starts[i] + group.counts[i]]


def _step_angles(group: ConcatenatedTracks, result: TrackStats) -> Floats:
    """The rotations (S, 4) at unit length, signs aligned within each track; what is counted goes into `result`."""
    lengths = np.sqrt(quaternion.dot(group.values, group.values))
    values = group.values / np.where(lengths > 0, lengths, 1)[..., None]
    dots = np.ones(len(values))  # of each key with the one before it; the first of a track has none
    dots[1:] = quaternion.dot(values[1:], values[:-1])
    dots[group.starts] = 1.0
    angles = 2 * np.arccos(np.minimum(np.abs(dots), 1.0))
    result.non_unit[group.numbers] = _sums(group, _unit_error(lengths, group.tracks, group.counts))
    if group.interpolation is not Interpolation.STEP:  # which never is on the way from one key to the next
        result.flips[group.numbers] = _sums(group, dots < 0)
    if group.interpolation is Interpolation.LINEAR:
        result.wide[group.numbers] = _sums(group, angles > WIDE_STEP)
    result.widest[group.numbers] = _largest(group, angles)
    return values * np.cumprod(np.where(dots < 0, -1.0, 1.0))[:, None]


def _same_values(group: ConcatenatedTracks, values: Floats) -> Bools:
    least, most = _extent(group, values)
    first = values[group.starts]
    off = np.maximum(most - first, first - least).max(axis=1)
    same: Bools = off <= FLOAT32 * _sizes(least, most)
    if group.tangents is not None:
        arriving, leaving = (_widest(each) for each in group.tangents)
        arriving[group.starts] = 0.0  # what leads to the first key and away from the last is never played
        leaving[group.starts + group.counts - 1] = 0.0
        same &= (_largest(group, arriving) == 0) & (_largest(group, leaving) == 0)
    return same


def _at_rest(group: ConcatenatedTracks, constant: Bools, skeleton: Skeleton) -> Bools:
    if group.path not in ("translation", "rotation", "scale"):
        return np.zeros(len(constant), np.bool_)
    nodes = [track.node if track.node is not None else -1 for track in group.tracks]
    resting: Floats = getattr(skeleton, group.path)[nodes]
    first = group.values[group.starts]
    if group.kind is ValueKind.ROTATION:
        first = first * np.where(quaternion.dot(first, resting) < 0, -1.0, 1.0)[:, None]
    near: Bools = np.abs(first - resting).max(axis=1) <= 1e-6 * (1 + np.abs(resting).max(axis=1))
    return constant & near


def _redundant(group: ConcatenatedTracks, values: Floats, constant: Bools) -> Bools:
    """Which keys (S,) inside a track that moves what is around them gives anyway."""
    of_track = np.repeat(np.arange(len(constant)), group.counts)
    inner = ~constant[of_track]
    inner[group.starts] = inner[group.starts + group.counts - 1] = False
    at = np.flatnonzero(inner)
    inner[at] = _is_interpolated(group, values, of_track, at)
    return np.asarray(inner)


def _is_interpolated(group: ConcatenatedTracks, values: Floats, of_track: Ints, at: Ints) -> Bools:
    """For each of the keys `at` (A,), none at an end of its track, whether the keys next to it give it."""
    before, here, after = values[at - 1], values[at], values[at + 1]
    if group.interpolation is Interpolation.STEP:
        return np.asarray(_widest(here - before) == 0)
    least, most = _extent(group, values)
    allowed = (REDUNDANT * (most - least).max(axis=1) + FLOAT32 * _sizes(least, most))[of_track[at]]
    duration = group.times[at + 1] - group.times[at - 1]
    u = (group.times[at] - group.times[at - 1]) / duration
    if group.tangents is not None:
        return _is_interpolated_cubic(group.tangents, values, at, u[:, None], duration[:, None], allowed)
    if group.kind is not ValueKind.ROTATION:
        between = before + u[:, None] * (after - before)
        return np.asarray(_widest(here - between) <= allowed)
    same = _widest(here - quaternion.slerp(before, after, u)) <= allowed
    narrow = quaternion.dot(before, after) > np.cos(WIDE_STEP / 2)
    return np.asarray(same & narrow & _same_lengths(group, of_track, at, u, allowed))


def _same_lengths(group: ConcatenatedTracks, of_track: Ints, at: Ints, u: Floats, allowed: Floats) -> Bools:
    """Whether quaternions as stored are as long as between their neighbors, but for rounding to integers."""
    before, here, after = (np.sqrt(quaternion.dot(q, q)) for q in (group.values[at + k] for k in (-1, 0, 1)))
    steps = np.array([STEPS.get(track.storage.component_type, np.inf) for track in group.tracks])
    off = np.abs(here - (before + u * (after - before)))
    return np.asarray(off <= allowed + 2 / steps[of_track[at]])


def _is_interpolated_cubic(
    tangents: tuple[Floats, Floats], values: Floats, at: Ints, u: Floats, duration: Floats, allowed: Floats
) -> Bools:
    arriving, leaving = tangents
    piece = (values[at - 1], duration * leaving[at - 1], values[at + 1], duration * arriving[at + 1])
    off = _widest(values[at] - hermite.evaluate(u, *piece))
    slope = hermite.first_derivative(u, *piece)  # per u of the joined piece: as large as the values
    bend = np.maximum(_widest(duration * arriving[at] - slope), _widest(duration * leaving[at] - slope))
    return np.asarray((off <= allowed) & (bend <= 10 * allowed))


def _sums(group: ConcatenatedTracks, counted: Bools) -> Ints:
    """How many keys of each track (T,) count."""
    return np.add.reduceat(counted, group.starts, dtype=np.int64)


def _largest(group: ConcatenatedTracks, sizes: Floats) -> Floats:
    """The largest number at any key of each track (T,)."""
    return np.maximum.reduceat(sizes, group.starts)


def _extent(group: ConcatenatedTracks, values: Floats) -> tuple[Floats, Floats]:
    """The least and the greatest value (T, C) of each track."""
    return np.minimum.reduceat(values, group.starts), np.maximum.reduceat(values, group.starts)


def _sizes(least: Floats, most: Floats) -> Floats:
    return np.asarray(np.maximum(np.abs(least), np.abs(most)).max(axis=1))


def _widest(vectors: Floats) -> Floats:
    """The largest component (S,) of each vector (S, C), without sign: by rows, since an axis of 3 or 4 is slow."""
    return np.asarray(np.abs(vectors.T, order="C").max(axis=0))
