"""Closing of loops in value and speed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from anim.arguments import index
from anim.arrays import Bools, Floats
from anim.errors import RangeError, check_number
from anim.maths import hermite, quaternion
from anim.model import Clip, Interpolation, Track, ValueKind
from anim.operations.selection import track_indices
from anim.operations.stacked_tracks import StackedTracks, change_tracks
from anim.operations.trim import cut_spline
from anim.sampling.derivatives import rates
from anim.sampling.times import check_fps, distinct_float32, min_interval
from anim.sampling.track import sample

DURATION_TOLERANCE_FRACTION = 1e-6  # of the last key's time, of a blend as long as the clip: float32 and %g round
MIN_BLEND_KEYS = 6  # fewest keys in a blend; sparser tracks get more
BLEND_FPS = 30.0  # of the added keys
MIN_BEFORE_LAST_FRACTION = 1e-9  # of a blend before its last segment; less is rounding
MIN_INTERVAL_S = 1e-5  # s, between two keys; more where float32 resolves less


def append_first_frame(clip: Clip, *, fps: float, tracks: frozenset[int] | None = None, root: int = -1) -> Clip:
    """Return the clip with its first pose appended as a frame: for a loop that lacks its last frame.

    root: node that travels, −1 for none: its translation doesn't return to its start but continues over the added
    frame, at the mean of its speeds at the end and at the start.
    (x = 0, 1, 2 at 0, 1, 2 s; fps 1) → 0, 1, 2, 0; of the root 0, 1, 2, 3
    """
    chosen = track_indices(clip, tracks)
    fps, root = check_fps(fps), index(root, "root")
    end = clip.end + 1 / fps
    return Clip(
        clip.name,
        tuple(
            _append_key(track, clip, end, travels=track.node == root and track.path == "translation")
            if i in chosen
            else track
            for i, track in enumerate(clip.tracks)
        ),
    )


def open_tracks(clip: Clip) -> frozenset[int]:
    """Return the indices of the tracks with different first and last value; q and −q are equal.

    (one track from 0 to 1 and back to 0, one from 0 to 1) → {1}
    """
    return frozenset(i for i, track in enumerate(clip.tracks) if not _is_closed(track))


def _is_closed(track: Track) -> bool:
    first, last = track.values[0], track.values[-1]
    return bool((first == last).all() or (track.kind is ValueKind.ROTATION and (first == -last).all()))


def loop(clip: Clip, *, blend: float, tracks: frozenset[int] | None = None, frame_rate: float | None = None) -> Clip:
    """Return the clip with its last `blend` seconds corrected to end as it starts, in value and speed.

    The correction is added to the motion: a cubic from 0 to the loop gap in value and speed; for rotations a rotation
    vector. The last segment of a LINEAR track gets the speed of the first one, which stays. STEP tracks have their
    first value at the end of the clip. Tracks not in `tracks` keep their end, for example of a traveling root.
    frame_rate: of the keys added in the blend, from its start; None for even spacing.
    Raises RangeError unless 0 < blend ≤ the clip's duration, which is that of float32 keys: 1.3 s is 1.29999995 s.
    """
    chosen = track_indices(clip, tracks)
    blend = check_number(blend, "blend")
    duration = clip.end - clip.start
    if not 0 < blend <= duration + DURATION_TOLERANCE_FRACTION * clip.end:
        raise RangeError(f"`blend` is {blend:g} s (expected more than 0, at most the clip's {duration:g} s)")
    blend = min(blend, duration)
    if frame_rate is not None:
        frame_rate = check_fps(frame_rate)
    at_end = _Blend(clip.start, clip.end - blend, clip.end, frame_rate)
    return change_tracks(clip, chosen, lambda tracks: _close(tracks, at_end))


def _append_key(track: Track, clip: Clip, end: float, *, travels: bool) -> Track:
    if len(track.times) == 1 or track.times[-1] < clip.end - 1e-6:
        return track
    last = _continue_travel(track, clip, end) if travels else sample(track, np.array([clip.start]))
    sign = 1.0
    if track.kind is ValueKind.ROTATION:
        sign = -1.0 if quaternion.dot(last, track.values[-1:])[0] < 0 else 1.0
    last = last * sign
    times, values = np.append(track.times, end), np.concatenate((track.values, last))
    if track.in_tangents is None or track.out_tangents is None:
        return track.with_keys(times, values)
    chord = (values[-1:] - values[-2:-1]) / (times[-1] - times[-2])
    leaving = np.concatenate((track.out_tangents[:-1], track.in_tangents[-1:], np.zeros_like(chord)))
    arriving = np.concatenate((track.in_tangents, track.out_tangents[:1] * sign))
    return track.with_keys(times, values, arriving, leaving)


def _continue_travel(track: Track, clip: Clip, end: float) -> Floats:
    """Return the value (1, C) at `end`, after the last key, between those of the end and the start."""
    before = rates(track, np.array([clip.end]), before=True)[0]
    after = rates(track, np.array([clip.start]), before=False)[0]
    return _extrapolate(track, track.values[-1], (before + after) / 2, end - clip.end)[None]


class _Blend(NamedTuple):
    """The part of a clip that is corrected: times of the clip's first key, of its own start and end, in s.

    frame_rate: of added keys.
    """

    first: float
    start: float
    end: float
    frame_rate: float | None


def _close(tracks: StackedTracks, blend: _Blend) -> Sequence[Track]:
    if len(tracks.times) == 1:
        return tracks.tracks
    ends = np.array([blend.first, blend.end])
    first, last = sample(tracks, ends)
    if tracks.interpolation is Interpolation.STEP:
        return _close_steps(tracks, blend.end, first)
    found: list[Track] = list(tracks.tracks)
    if len(tracks.times) > 2 and tracks.times[-2] > blend.end - min_interval(blend.end, MIN_INTERVAL_S):
        tracks = _without_last_jump(tracks)
        found, last = tracks.split(), tracks.values[-1]
    gap = _closing_offset(tracks, first, last)
    speed = rates(tracks, ends[:1], before=False)[0]
    change = speed - rates(tracks, ends[1:], before=True)[0]
    is_open = gap.any(axis=-1) | change.any(axis=-1)
    if is_open.any():
        closed = _correct(
            tracks.pick(is_open), blend, first[is_open], speed[is_open], gap=gap[is_open], change=change[is_open]
        )
        for i, track in zip(np.flatnonzero(is_open).tolist(), closed, strict=True):
            found[i] = track
    return found


def _correct(
    tracks: StackedTracks, blend: _Blend, first: Floats, speed: Floats, *, gap: Floats, change: Floats
) -> list[Track]:
    """The tracks, of which a clip starts with values `first` and `speed` (G, C), without the gaps at its end."""
    times = _times(tracks, blend.start, blend.end, blend.frame_rate)
    if tracks.in_tangents is not None:
        return _correct_spline(tracks, times, _Correction(blend.start, blend.end, gap, change))
    values, last_piece = sample(tracks, times), float(times[-1] - times[-2])
    before_last = _closing_offset(tracks, _extrapolate(tracks, first, speed, -last_piece), values[-2])
    start = _correction_start(times, blend)
    correction = _Correction(start, blend.end, gap, _end_slope(gap, before_last, blend.end - start, last_piece))
    return tracks.with_keys(times, _add_correction(tracks, values, correction.value(times))).split()


def _correction_start(times: Floats, blend: _Blend) -> float:
    """Return the blend's start, after the first segment of keys (K,): the last one gets the speed which that has."""
    second = int(np.searchsorted(times, blend.first + MIN_INTERVAL_S, side="right"))
    return max(blend.start, float(times[min(second, len(times) - 2)]))


def _close_steps(tracks: StackedTracks, end: float, first: Floats) -> list[Track]:
    """STEP tracks with their first value (G, C) at the end of the clip, which may be after their last key."""
    if tracks.times[-1] > end - min_interval(end, MIN_INTERVAL_S):
        values = np.concatenate((tracks.values[:-1], first[None]))
        return tracks.with_keys(tracks.time_axis, values).split()
    values = np.concatenate((tracks.values, first[None]))
    closed = tracks.with_keys(np.append(tracks.times, end), values).split()
    same = (tracks.values[-1] == first).all(axis=-1).tolist()
    return [old if is_same else new for old, new, is_same in zip(tracks.tracks, closed, same, strict=True)]


def _without_last_jump(track: StackedTracks) -> StackedTracks:
    """Return tracks without a jump between their last two keys, which the correction replaces."""
    before, after = track.in_tangents, track.out_tangents
    times, values = np.append(track.times[:-2], track.times[-1]), track.values[:-1]
    if before is None or after is None:
        return track.with_keys(times, values)
    return track.with_keys(times, values, before[:-1], after[:-1])


def _closing_offset(track: StackedTracks, first: Floats, last: Floats) -> Floats:
    if track.kind is ValueKind.ROTATION:
        return quaternion.rotation_vector(quaternion.multiply(quaternion.conjugate(last), first))
    return first - last


def _extrapolate(track: Track | StackedTracks, value: Floats, speed: Floats, seconds: float) -> Floats:
    """Return the value some seconds after `value` at constant speed."""
    if track.kind is ValueKind.ROTATION:
        return quaternion.multiply(value, quaternion.from_rotation_vector(seconds * speed))
    return value + seconds * speed


def _end_slope(gap: Floats, before_last: Floats, duration: float, last: float) -> Floats:
    """Return the end slope of the correction cubic.

    The cubic is 0 with slope 0 at first, `gap` after `duration` seconds, and `before_last` at `last` seconds earlier.
    """
    share = 1 - last / duration
    if share < MIN_BEFORE_LAST_FRACTION:  # no key between, so no speed of the last segment but that of its ends
        return np.zeros_like(gap)
    # c(s) = (3 g − m) s² + (m − 2 g) s³ with m the slope per duration, so that c(1) = g and c'(1) = m
    return (gap * (3 * share**2 - 2 * share**3) - before_last) / (share**2 * (1 - share)) / duration


class _Correction:
    """Correction from `start` to `end`: 0 with speed 0 at first, `gap` (G, C) with `speed` (per second) at last."""

    def __init__(self, start: float, end: float, gap: Floats, speed: Floats) -> None:
        self.start, self.end = start, end
        self._duration = end - start
        self._piece = (np.zeros_like(gap), np.zeros_like(gap), gap, speed * self._duration)

    def value(self, times: Floats) -> Floats:
        return np.where(self._inside(times), hermite.evaluate(self._share(times), *self._piece), 0.0)

    def slope(self, times: Floats) -> Floats:
        slopes = hermite.first_derivative(self._share(times), *self._piece) / self._duration
        return np.where(self._inside(times), slopes, 0.0)

    def _share(self, times: Floats) -> Floats:
        return np.clip((times - self.start) / self._duration, 0.0, 1.0)[:, None, None]

    def _inside(self, times: Floats) -> Bools:
        return (times > self.start)[:, None, None]


def _times(track: StackedTracks, start: float, end: float, frame_rate: float | None) -> Floats:
    """Return the track's key times with the ends of the blend and, for sparse keys, some between."""
    keys = track.times
    inside, spacing = keys[(keys > start) & (keys < end)], (end - start) / MIN_BLEND_KEYS
    more = np.array([start, end])
    rotates = track.in_tangents is not None and track.kind is ValueKind.ROTATION  # normalized anew between its keys
    is_dense = len(inside) >= MIN_BLEND_KEYS and max(inside[0] - start, end - inside[-1]) <= spacing
    if rotates or not is_dense:
        more = _added_times(start, end, frame_rate)
    more = more[distinct_float32(more)]
    more = more[np.abs(more[:, None] - keys).min(axis=1) > min_interval(end, MIN_INTERVAL_S)]
    return np.sort(np.concatenate((keys, more)))


def _added_times(start: float, end: float, frame_rate: float | None) -> Floats:
    if frame_rate is None:
        return np.linspace(start, end, max(2 * MIN_BLEND_KEYS, round((end - start) * BLEND_FPS) + 1))
    frames = start + np.arange(int((end - start) * frame_rate) + 1) / frame_rate
    return np.append(frames[frames < end - 0.5 / frame_rate], end)


def _add_correction(track: StackedTracks, values: Floats, added: Floats) -> Floats:
    if track.kind is not ValueKind.ROTATION:
        return values + added
    return quaternion.align_signs(quaternion.multiply(values, quaternion.from_rotation_vector(added)))


def _correct_spline(track: StackedTracks, times: Floats, correction: _Correction) -> list[Track]:
    before = rates(track, times, before=True) + correction.slope(times)
    after = rates(track, times, before=False) + correction.slope(times)
    values = _add_correction(track, sample(track, times), correction.value(times))
    if track.kind is ValueKind.ROTATION:
        before, after = quaternion.derivative(values, before), quaternion.derivative(values, after)
    before[0], after[-1] = 0.0, 0.0
    corrected = track.with_keys(times, values, before, after).split()
    cut = int(np.abs(times - correction.start).argmin())
    if track.kind is not ValueKind.ROTATION or cut == 0:
        return corrected
    return [
        _join_splines(cut_spline(old, float(times[0]), float(times[cut])), new, cut)
        for old, new in zip(track.split(), corrected, strict=True)
    ]


def _join_splines(first: Track, second: Track, index: int) -> Track:
    """Return `first` and then the keys of `second` after `index`, with signs that follow from `first`."""
    assert first.in_tangents is not None
    assert first.out_tangents is not None
    assert second.in_tangents is not None
    assert second.out_tangents is not None
    sign = -1.0 if quaternion.dot(first.values[-1], second.values[index]) < 0 else 1.0
    return first.with_keys(
        np.concatenate((first.times, second.times[index + 1 :])),
        np.concatenate((first.values, second.values[index + 1 :] * sign)),
        np.concatenate((first.in_tangents, second.in_tangents[index + 1 :] * sign)),
        np.concatenate((first.out_tangents[:-1], second.out_tangents[index:] * sign)),
    )
