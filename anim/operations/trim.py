"""Trimming of clips, with exact new ends."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from anim.arguments import check_flags
from anim.arrays import Bools, Floats
from anim.curves.fitting.adaptive_keys import TrackFunction, cubic_keys
from anim.errors import RangeError, check_number
from anim.maths import quaternion
from anim.model import Clip, Interpolation, Track, ValueKind
from anim.operations.retime import shift_time
from anim.operations.selection import track_indices
from anim.operations.stacked_tracks import StackedTracks, change_tracks
from anim.sampling.derivatives import rates
from anim.sampling.track import Keys, sample

Spline = TypeVar("Spline", Track, StackedTracks)
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
    check_flags(rebase=rebase)
    start = None if start is None else check_number(start, "start")
    end = None if end is None else check_number(end, "end")
    if (start is not None or end is not None) and clip.end > clip.start:
        clip = _trim_clip(clip, start, end, chosen)
    first = min((float(clip.tracks[i].times[0]) for i in chosen), default=0.0)
    if not rebase or first == 0:
        return clip
    return Clip(clip.name, tuple(shift_time(t, -first) if i in chosen else t for i, t in enumerate(clip.tracks)))


def _trim_clip(clip: Clip, start: float | None, end: float | None, chosen: frozenset[int]) -> Clip:
    first = clip.start if start is None or start <= clip.start else max(float(np.float32(start)), clip.start)
    last = clip.end if end is None or end >= clip.end else min(float(np.float32(end)), clip.end)
    if not last > first:
        raise RangeError(_nothing_left(clip, start, end))
    new = list(change_tracks(clip, chosen, lambda tracks: _trim_tracks(tracks, first, last)).tracks)
    if chosen and all(track.times[-1] < last for track in new):
        new[min(chosen)] = _constant_keys(new[min(chosen)], first, last)
    return Clip(clip.name, tuple(new))


def _nothing_left(clip: Clip, start: float | None, end: float | None) -> str:
    if start is not None and start >= clip.end:
        return f"start {start:g} s is at or after the clip's end ({clip.end:.4g} s)"
    if end is not None and end <= clip.start:
        return f"end {end:g} s is at or before the clip's start ({clip.start:.4g} s)"
    return f"end {end or 0.0:g} s must be after start {start or 0.0:g} s"


def _trim_tracks(tracks: StackedTracks, start: float, end: float) -> Sequence[Track]:
    inner = (tracks.times > start) & (tracks.times < end)
    if len(tracks.times) == 1:
        return _single_key(tracks, start).split()
    if inner.any():
        return _cut(tracks, start, end)
    found = _single_key(tracks, start).split()
    changing = _changes(tracks, start, end)
    if not changing.any():
        return found
    for i, track in zip(np.flatnonzero(changing).tolist(), _cut(tracks.pick(changing), start, end), strict=True):
        found[i] = track
    return found


def _cut(tracks: StackedTracks, start: float, end: float) -> Sequence[Track]:
    if tracks.interpolation is Interpolation.CUBICSPLINE:
        if tracks.kind is ValueKind.ROTATION:  # with added keys of its own each
            return [cut_spline(track, start, end) for track in tracks.split()]
        return cut_spline(tracks, start, end).split()
    inner = (tracks.times > start) & (tracks.times < end)
    times = np.concatenate(([start], tracks.times[inner], [end]))
    values = np.concatenate((sample(tracks, times[:1]), tracks.values[inner], sample(tracks, times[-1:])))
    if tracks.kind is ValueKind.ROTATION:
        values *= _cut_signs(values, np.concatenate(([False], np.ones(inner.sum(), bool), [False])))
    return tracks.with_keys(times, values).split()


def _changes(tracks: StackedTracks, start: float, end: float) -> Bools:
    """Mask (G,) of tracks without a key in between that have different end values or a non-zero speed there."""
    ends = sample(tracks, np.array([start, end]))
    found: Bools = (ends[0] != ends[1]).any(axis=-1)
    if tracks.interpolation is not Interpolation.STEP:
        found |= rates(tracks, np.array([start]), before=False)[0].any(axis=-1)
    return found


def _single_key(tracks: StackedTracks, start: float) -> StackedTracks:
    values = sample(tracks, np.array([start]))
    linear = Interpolation.LINEAR if tracks.interpolation is Interpolation.CUBICSPLINE else tracks.interpolation
    return tracks.with_keys([start], values, interpolation=linear)


def _constant_keys(track: Track, start: float, end: float) -> Track:
    """A track of one key with equal keys at both ends."""
    return track.with_keys([start, end], np.repeat(track.values, 2, axis=0))


def cut_spline(track: Spline, start: float, end: float) -> Spline:
    """Return the part of a CUBICSPLINE track from `start` to `end`: keys between unchanged, ends exact.

    Or that of several tracks, but for rotations.
    """
    inner = (track.times > start) & (track.times < end)
    times = np.concatenate(([start], track.times[inner], [end]))
    if isinstance(track, Track) and track.kind is ValueKind.ROTATION:
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
    """Signs (K, ..., 1) of quaternion keys for which those of cut segments continue their neighbors.

    Original keys (`exact`) keep theirs: a spline between q and −q takes the long arc, and would change with its signs.
    """
    aligned = quaternion.align_signs(values)
    signs = np.where(quaternion.dot(aligned, values) < 0, -1.0, 1.0)
    if exact.any():
        first, last = np.flatnonzero(exact)[[0, -1]]
        signs[:first] *= signs[first]
        signs[last + 1 :] *= signs[last]
        signs[first : last + 1] = 1.0
    return signs[..., None]


def _restore_tangents(track: Keys, times: Floats, exact: Bools, before: Floats, after: Floats) -> None:
    """Restore the tangents of original keys bit for bit, except on the side of a cut."""
    assert track.in_tangents is not None
    assert track.out_tangents is not None
    at = np.searchsorted(track.times, times[exact])
    whole_before, whole_after = exact & np.insert(exact[:-1], 0, False), exact & np.append(exact[1:], False)
    before[whole_before] = track.in_tangents[at][whole_before[exact]]
    after[whole_after] = track.out_tangents[at][whole_after[exact]]
