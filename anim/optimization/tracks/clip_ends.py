"""First and last keys: loop closure, constant extension, single keys.

Loop closure: equal first and last keys of a track stay equal, to the bit.

q and −q are the same rotation; if the last key is −q, it stays the first one with all signs changed, so that
neighboring keys keep their signs.
"""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats, Ints
from anim.model import Clip, Interpolation, Track, ValueKind


def closure_signs(values: Floats, tolerances: Floats) -> Floats:
    """Return s (G,) where the last of the values (G, K, C) of a track is s · the first within its tolerance; else 0.

    tolerances: (G,), in units of the values. s is −1 only for rotations that end with the opposite sign; callers pass
    no other values that change sign.
    ([[0 0 0 1] … [0 0 0 −1]], [0]) → [−1]
    """
    first, last = values[:, 0], values[:, -1]
    apart = np.linalg.norm(last - first, axis=1)
    signs = np.where(apart <= tolerances, 1.0, 0.0)
    if values.shape[2] == 4:
        opposite = np.linalg.norm(last + first, axis=1)
        signs = np.where(opposite < apart, np.where(opposite <= tolerances, -1.0, 0.0), signs)
    return signs


def close_ends(keys: Floats, signs: Floats, counts: Ints) -> None:
    """Make the ends of keys (C, T, K) equal where `signs` (T,) is not 0: both become their mean; rotations stay unit.

    counts: (T,) of each track's keys, of which the others are ignored.
    """
    tied = np.flatnonzero(signs)
    last, sign = counts[tied] - 1, signs[tied]
    ends = (keys[:, tied, 0] + sign * keys[:, tied, last]) / 2
    if len(keys) == 4:
        ends /= np.sqrt((ends * ends).sum(axis=0))
    keys[:, tied, 0], keys[:, tied, last] = ends, sign * ends


def opened_tracks(before: Clip, after: Clip) -> list[tuple[int | None, str]]:
    """Return the targets with equal first and last values in `before`, but not in `after`.

    Tracks that `after` lacks are at rest, and so closed.
    """
    closed = {track.target for track in before.tracks if is_closed(track)}
    return [track.target for track in after.tracks if track.target in closed and not is_closed(track)]


def is_closed(track: Track) -> bool:
    """Return whether the first and the last value are equal to the bit; q and −q are equal."""
    first, last = track.values[[0, -1]].tolist()  # faster than numpy for so few values
    return bool(first == last or (track.kind is ValueKind.ROTATION and first == [-each for each in last]))


def single_key(track: Track) -> Track:
    """Return the first value of a track as its only key."""
    name = Interpolation.STEP if track.interpolation is Interpolation.STEP else Interpolation.LINEAR
    return track.with_keys(track.times[:1], track.values[:1], interpolation=name)


def extend(track: Track, start: float, end: float) -> Track:
    """Return the track with its first value constant from `start`, its last up to `end`.

    Splines get zero tangents there.
    """
    head, tail = bool(track.times[0] > start), bool(track.times[-1] < end)
    inner = slice(1, None) if head and tail and len(track.times) == 1 else slice(None)  # two keys hold one value
    rows = [0] * head + list(range(len(track.times))[inner]) + [-1] * tail
    at = np.concatenate(([start] * head, track.times[inner], [end] * tail))
    if track.in_tangents is None or track.out_tangents is None:
        return track.with_keys(at, track.values[rows])
    arriving, leaving = track.in_tangents[rows], track.out_tangents[rows]
    if head:
        leaving[0] = arriving[1] = 0
    if tail:
        leaving[-2] = arriving[-1] = 0
    return track.with_keys(at, track.values[rows], arriving, leaving)
