"""Trimming of clips, with exact new ends."""

from __future__ import annotations

import math

import numpy as np

from anim.arrays import Bools, Floats
from anim.curves.fitting.adaptive_keys import TrackFunction, cubic_keys
from anim.errors import RangeError, check_number
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Track, ValueKind
from anim.operations.retime import shift_time
from anim.operations.selection import track_indices
from anim.sampling.derivatives import rates
from anim.sampling.track import sample

ANGLE_TOLERANCE_RAD = math.radians(0.001)  # between a cut of a rotation spline and the next key; ends are exact


def trim(
    clip: Clip,
    *,
    start: float | None = None,
    end: float | None = None,
    rebase: bool = False,
    tracks: frozenset[int] | None = None,
) -> Clip:
    """Return the clip from `start` to `end` s; keys between are unchanged, keys at the ends exact.

    New end keys have the track's value and, under CUBICSPLINE, its tangent; a cut segment of a rotation spline gets
    more keys if its normalization needs them. A constant track without a key in between becomes one key; if all do, the
    first keeps a key at the end, since the keys alone give the clip its duration.
    start, end: by default the clip's own; times outside are clamped to it, others rounded to float32 like keys.
    Without both, or if the clip has one time only, nothing is cut.
    rebase: shift the part to start at 0 s. Raises RangeError for an empty part.
    (keys 0, 1 s: 0, 10; start 0.25) → keys 0.25, 1 s: 2.5, 10
    """
    chosen = track_indices(clip, tracks)
    for name, time in (("start", start), ("end", end)):
        if time is not None:
            check_number(time, name)
    if (start is not None or end is not None) and clip.end > clip.start:
        clip = _trim_clip(clip, start, end, chosen)
    first = min((float(clip.tracks[i].times[0]) for i in chosen), default=0.0)
    if not rebase or first == 0:
        return clip
    return Clip(clip.name, tuple(shift_time(t, -first) if i in chosen else t for i, t in enumerate(clip.tracks)))


def _trim_clip(clip: Clip, start: float | None, end: float | None, chosen: frozenset[int]) -> Clip:
    first = clip.start if start is None else max(float(np.float32(start)), clip.start)
    last = clip.end if end is None else min(float(np.float32(end)), clip.end)
    if not last > first:
        raise RangeError(_nothing_left(clip, start, end))
    new = [_trim_track(track, first, last) if i in chosen else track for i, track in enumerate(clip.tracks)]
    if chosen and all(track.times[-1] < last for track in new):
        new[min(chosen)] = _constant_keys(new[min(chosen)], first, last)
    return Clip(clip.name, tuple(new))


def _nothing_left(clip: Clip, start: float | None, end: float | None) -> str:
    if start is not None and start >= clip.end:
        return f"start {start:g} s is at or after the clip's end ({clip.end:.4g} s)"
    if end is not None and end <= clip.start:
        return f"end {end:g} s is at or before the clip's start ({clip.start:.4g} s)"
    return f"end {end or 0.0:g} s must be after start {start or 0.0:g} s"


def _trim_track(track: Track, start: float, end: float) -> Track:
    inner = (track.times > start) & (track.times < end)
    if len(track.times) == 1 or not (inner.any() or _changes(track, start, end)):
        return _single_key(track, start)
    if track.interpolation is Interpolation.CUBICSPLINE:
        return cut_spline(track, start, end)
    times = np.concatenate(([start], track.times[inner], [end]))
    values = np.concatenate((sample(track, times[:1]), track.values[inner], sample(track, times[-1:])))
    if track.kind is ValueKind.ROTATION:
        values *= _cut_signs(values, np.concatenate(([False], np.ones(inner.sum(), bool), [False])))
    return track.with_keys(times, values)


def _changes(track: Track, start: float, end: float) -> bool:
    """Return whether a track without a key in between has different end values or a non-zero speed there."""
    ends = sample(track, np.array([start, end]))
    moving = track.interpolation is not Interpolation.STEP and bool(rates(track, np.array([start]), before=False).any())
    return moving or bool((ends[0] != ends[1]).any())


def _single_key(track: Track, start: float) -> Track:
    values = sample(track, np.array([start]))
    linear = Interpolation.LINEAR if track.interpolation is Interpolation.CUBICSPLINE else track.interpolation
    return track.with_keys([start], values, interpolation=linear)


def _constant_keys(track: Track, start: float, end: float) -> Track:
    """A track of one key with equal keys at both ends."""
    return track.with_keys([start, end], np.repeat(track.values, 2, axis=0))


def cut_spline(track: Track, start: float, end: float) -> Track:
    """Return the part of a CUBICSPLINE track from `start` to `end`: keys between unchanged, ends exact."""
    inner = (track.times > start) & (track.times < end)
    times = np.concatenate(([start], track.times[inner], [end]))
    if track.kind is ValueKind.ROTATION:
        times = _insert_cut_times(track, times)
    values = sample(track, times)
    before, after = rates(track, times, before=True), rates(track, times, before=False)
    exact = np.isin(times, track.times)
    values[exact] = track.values[np.isin(track.times, times)]
    if track.kind is ValueKind.ROTATION:
        values *= _cut_signs(values, exact)
        before, after = quaternion.derivative(values, before), quaternion.derivative(values, after)
    _restore_tangents(track, times, exact, before, after)
    before[0], after[-1] = 0.0, 0.0
    return track.with_keys(times, values, before, after)


def _insert_cut_times(track: Track, times: Floats) -> Floats:
    """The times, with more in the cut end segments, as a rotation's cubic is normalized anew."""
    motion = TrackFunction(
        lambda at, before: sample(track, at), rotation=True, rates=lambda at, before: rates(track, at, before=before)
    )
    parts = [times]
    for piece in (times[:2], times[-2:]):
        if not np.isin(piece, track.times).all():
            parts.append(cubic_keys(track, motion, piece, tolerance=ANGLE_TOLERANCE_RAD).times)
    return np.unique(np.concatenate(parts))


def _cut_signs(values: Floats, exact: Bools) -> Floats:
    """Signs (K, 1) of quaternion keys for which those of cut segments continue their neighbors.

    Original keys (`exact`) keep theirs: a spline between q and −q takes the long arc, and would change with its signs.
    """
    aligned = quaternion.align_signs(values)
    signs = np.where(quaternion.dot(aligned, values) < 0, -1.0, 1.0)
    if exact.any():
        first, last = np.flatnonzero(exact)[[0, -1]]
        signs[:first] *= signs[first]
        signs[last + 1 :] *= signs[last]
        signs[first : last + 1] = 1.0
    return signs[:, None]


def _restore_tangents(track: Track, times: Floats, exact: Bools, before: Floats, after: Floats) -> None:
    """Restore the tangents of original keys bit for bit, except on the side of a cut."""
    assert track.in_tangents is not None
    assert track.out_tangents is not None
    at = np.searchsorted(track.times, times[exact])
    whole_before, whole_after = exact & np.insert(exact[:-1], 0, False), exact & np.append(exact[1:], False)
    before[whole_before] = track.in_tangents[at][whole_before[exact]]
    after[whole_after] = track.out_tangents[at][whole_after[exact]]
