"""Statistics of keys: constant tracks, redundant keys, wide steps, rotations not of unit length."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.maths import hermite, quaternion
from anim.measure.inspect.redundant_keys import redundant_keys
from anim.model import Interpolation, Skeleton, Track, ValueKind
from anim.model.track import BYTE_UNIT_TOLERANCE
from anim.sampling.batch import ConcatenatedTracks, concatenate, iterate_concatenated

FLOAT32_TOLERANCE = 2.0**-22  # relative; twice the spacing of float32: values closer than this are equal
KEY_TOLERANCE_PER_RANGE = 1e-6  # fraction of a track's range: tolerance of interpolated keys
UNIT_TOLERANCE = 1e-3  # of the length of other quaternions
MAX_INTEGERS = {
    5120: 127,
    5121: 255,
    5122: 32767,
    5123: 65535,
}  # integer for 1.0 by component type, of normalized integers
BLOCK_KEYS = 100_000  # that are compared with their neighbors at once, each about 200 bytes
WIDE_STEP_RAD = np.radians(170.0)  # rad; from here on players disagree on the shorter arc


class TrackStats(NamedTuple):
    """Statistics of T tracks; arrays (T,).

    constant: never changes. no_effect: constant, and equal to the rest pose. redundant: keys whose removal saves bytes
    (see `removable_keys`) without creating wide steps or changing the motion in players that do not normalize
    rotations; of constant tracks one key is needed, of splines two.
    non_unit, flips, wide: number of rotation keys that are not of unit length, of sign changes from key to key (not
    under STEP), of steps of 170° or more (under LINEAR only).
    widest: largest step in rad.
    """

    constant: Bools
    no_effect: Bools
    redundant: Ints
    non_unit: Ints
    flips: Ints
    wide: Ints
    widest: Floats

    def of_tracks(self, part: slice) -> TrackStats:
        """Return the statistics of some of the tracks."""
        return TrackStats._make(each[part] for each in self)


def stats(groups: Sequence[ConcatenatedTracks], skeleton: Skeleton) -> TrackStats:
    """Return the statistics of concatenated tracks, in the tracks' original order."""
    result, masks = _all_stats(groups, skeleton)
    for i, mask in masks.items():
        result.redundant[i] += np.count_nonzero(mask)
    return result


def removable_keys(tracks: Sequence[Track], skeleton: Skeleton) -> list[Bools]:
    """Return masks (K,) of the keys of each track whose removal saves bytes; False for constant tracks.

    (keys at 0, 1, 2 s with the values 0, 5, 10) → [False, True, False]
    """
    masks = _all_stats(concatenate(tracks), skeleton)[1]
    return [masks[i] if i in masks else np.zeros(len(track.times), np.bool_) for i, track in enumerate(tracks)]


def non_unit_keys(tracks: Sequence[Track]) -> list[int]:
    """Return the number of rotation keys of each track that are not of unit length within rounding."""
    found = [0] * len(tracks)
    turning = [i for i, track in enumerate(tracks) if track.kind is ValueKind.ROTATION]
    for group in iterate_concatenated([tracks[i] for i in turning]):
        off = _unit_error(_lengths(group), group.tracks, group.counts)
        for i, count in zip(group.numbers.tolist(), _sums(group, off).tolist(), strict=True):
            found[turning[i]] = count
    return found


def _lengths(group: ConcatenatedTracks) -> Floats:
    return np.asarray(np.sqrt(quaternion.dot(group.values, group.values)))


def _unit_error(lengths: Floats, tracks: Sequence[Track], counts: Ints | list[int]) -> Bools:
    """Mask (S,) of keys with a length that differs from 1 by more than the rounding of their storage."""
    bytes_only = np.array([track.storage.component_type in (5120, 5121) for track in tracks])
    return np.asarray(
        np.abs(lengths - 1) > np.repeat(np.where(bytes_only, BYTE_UNIT_TOLERANCE, UNIT_TOLERANCE), counts)
    )


def _all_stats(groups: Sequence[ConcatenatedTracks], skeleton: Skeleton) -> tuple[TrackStats, dict[int, Bools]]:
    """The statistics, with redundant keys of constant tracks only, and masks of the others' keys."""
    count = sum(len(group.tracks) for group in groups)
    result = TrackStats(*(np.zeros(count, kind) for kind in (bool, bool, int, int, int, int, float)))
    tracks: dict[int, Track] = {}
    given: dict[int, Bools] = {}
    for group in groups:
        _count(group, skeleton, result, given)
        tracks.update(zip(group.numbers.tolist(), group.tracks, strict=True))
    return result, redundant_keys([tracks[i] for i in range(count)], given)


def _count(group: ConcatenatedTracks, skeleton: Skeleton, result: TrackStats, given: dict[int, Bools]) -> None:
    """Write the statistics of a group into `result`, masks of its tracks' interpolated keys into `given`."""
    values, lengths = group.values, None
    if group.kind is ValueKind.ROTATION:
        lengths = _lengths(group)
        values = _step_angles(group, lengths, result)
    extent = _extent(group, values)
    constant = _same_values(group, values, extent)
    result.constant[group.numbers] = constant
    result.no_effect[group.numbers] = _at_rest(group, constant, skeleton)
    fewest = 1 if group.tangents is None else 2
    result.redundant[group.numbers] = np.where(constant, np.maximum(group.counts - fewest, 0), 0)
    mask = _redundant(group, values, lengths, constant, extent)
    for i in np.flatnonzero(~constant).tolist():
        given[int(group.numbers[i])] = mask[group.starts[i] : group.starts[i] + group.counts[i]]


def _step_angles(group: ConcatenatedTracks, lengths: Floats, result: TrackStats) -> Floats:
    """The rotations (S, 4) of lengths (S,) at unit length, signs aligned; their counts are written into `result`."""
    values = group.values / np.where(lengths > 0, lengths, 1)[..., None]
    dots = np.ones(len(values))  # of each key with the one before it; the first of a track has none
    dots[1:] = quaternion.dot(values[1:], values[:-1])
    dots[group.starts] = 1.0
    angles = 2 * np.arccos(np.minimum(np.abs(dots), 1.0))
    result.non_unit[group.numbers] = _sums(group, _unit_error(lengths, group.tracks, group.counts))
    if group.interpolation is not Interpolation.STEP:  # STEP never interpolates between keys
        result.flips[group.numbers] = _sums(group, dots < 0)
    if group.interpolation is Interpolation.LINEAR:
        result.wide[group.numbers] = _sums(group, angles > WIDE_STEP_RAD)
    result.widest[group.numbers] = _largest(group, angles)
    return values * np.cumprod(np.where(dots < 0, -1.0, 1.0))[:, None]


def _same_values(group: ConcatenatedTracks, values: Floats, extent: tuple[Floats, Floats]) -> Bools:
    least, most = extent
    first = values[group.starts]
    off = np.maximum(most - first, first - least).max(axis=1)
    same: Bools = off <= FLOAT32_TOLERANCE * _sizes(least, most)
    if group.tangents is not None:
        arriving, leaving = (_widest(each) for each in group.tangents)
        arriving[group.starts] = 0.0  # the tangents before the first and after the last key are not used
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


def _redundant(
    group: ConcatenatedTracks,
    values: Floats,
    lengths: Floats | None,
    constant: Bools,
    extent: tuple[Floats, Floats],
) -> Bools:
    """Mask (S,) of inner keys of moving tracks that are interpolated by their neighbors.

    values: rotations at unit length. lengths: (S,), as stored. extent: of the values of each track.
    """
    of_track = np.repeat(np.arange(len(constant)), group.counts)
    inner = ~constant[of_track]
    inner[group.starts] = inner[group.starts + group.counts - 1] = False
    least, most = extent
    allowed = KEY_TOLERANCE_PER_RANGE * (most - least).max(axis=1) + FLOAT32_TOLERANCE * _sizes(least, most)
    chosen = np.flatnonzero(inner)
    for start in range(0, len(chosen), BLOCK_KEYS):
        at = chosen[start : start + BLOCK_KEYS]
        inner[at] = _is_interpolated(group, values, lengths, of_track, at, allowed[of_track[at]])
    return np.asarray(inner)


def _is_interpolated(
    group: ConcatenatedTracks, values: Floats, lengths: Floats | None, of_track: Ints, at: Ints, allowed: Floats
) -> Bools:
    """Mask (A,) of the inner keys at indices `at` (A,) that are interpolated by their neighbors.

    lengths: (S,), of rotations. allowed: (A,) largest difference.
    """
    before, here, after = values[at - 1], values[at], values[at + 1]
    if group.interpolation is Interpolation.STEP:
        return np.asarray(_widest(here - before) == 0)
    duration = group.times[at + 1] - group.times[at - 1]
    u = (group.times[at] - group.times[at - 1]) / duration
    if group.tangents is not None:
        return _is_interpolated_cubic(group.tangents, values, at, u[:, None], duration[:, None], allowed)
    if lengths is None:
        between = before + u[:, None] * (after - before)
        return np.asarray(_widest(here - between) <= allowed)
    same = _widest(here - quaternion.slerp(before, after, u)) <= allowed
    narrow = quaternion.dot(before, after) > np.cos(WIDE_STEP_RAD / 2)
    return np.asarray(same & narrow & _same_lengths(group, lengths, of_track, at, u, allowed))


def _same_lengths(
    group: ConcatenatedTracks, lengths: Floats, of_track: Ints, at: Ints, u: Floats, allowed: Floats
) -> Bools:
    """Return whether stored quaternions have the length interpolated from their neighbors."""
    before, here, after = lengths[at - 1], lengths[at], lengths[at + 1]
    steps = np.array([MAX_INTEGERS.get(track.storage.component_type, np.inf) for track in group.tracks])
    off = np.abs(here - (before + u * (after - before)))
    return np.asarray(off <= allowed + 2 / steps[of_track[at]])


def _is_interpolated_cubic(
    tangents: tuple[Floats, Floats], values: Floats, at: Ints, u: Floats, duration: Floats, allowed: Floats
) -> Bools:
    arriving, leaving = tangents
    piece = (values[at - 1], duration * leaving[at - 1], values[at + 1], duration * arriving[at + 1])
    off = _widest(values[at] - hermite.evaluate(u, *piece))
    slope = hermite.first_derivative(u, *piece)  # per u of the combined segment: as large as the values
    bend = np.maximum(_widest(duration * arriving[at] - slope), _widest(duration * leaving[at] - slope))
    return np.asarray((off <= allowed) & (bend <= 10 * allowed))


def _sums(group: ConcatenatedTracks, counted: Bools) -> Ints:
    """Number of marked keys of each track (T,)."""
    return np.add.reduceat(counted, group.starts, dtype=np.int64)


def _largest(group: ConcatenatedTracks, sizes: Floats) -> Floats:
    """Maximum over the keys of each track (T,)."""
    return np.maximum.reduceat(sizes, group.starts)


def _extent(group: ConcatenatedTracks, values: Floats) -> tuple[Floats, Floats]:
    """Minimum and maximum value (T, C) of each track."""
    return np.minimum.reduceat(values, group.starts), np.maximum.reduceat(values, group.starts)


def _sizes(least: Floats, most: Floats) -> Floats:
    return np.asarray(np.maximum(np.abs(least), np.abs(most)).max(axis=1))


def _widest(vectors: Floats) -> Floats:
    """Largest absolute component (S,) of each vector (S, C).

    By rows: reductions over an axis of 3 or 4 are slow.
    """
    return np.asarray(np.abs(vectors.T, order="C").max(axis=0))
