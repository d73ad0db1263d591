"""Retiming of clips: scale, shift, reverse, ping-pong; tangents follow by the chain rule."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from anim.arguments import check_flags
from anim.arrays import Floats
from anim.errors import RangeError, UnsupportedError, check_number
from anim.model import Clip, Interpolation, TimeAxis, Track
from anim.operations.selection import track_indices
from anim.sampling.times import jump_time_after, separate_float32

NEAR_ZERO_S = 5e-4  # starts this near to 0 become 0, since printed times are rounded
MAX_SPEED = 1e9  # an hour in microseconds
MIN_DURATION_S = 1e-6  # below, keys of a second fall together in float32
MAX_END_S = 2.0**24  # s, 194 days; after it, float32 times do not differ by 1 s


def retime(
    clip: Clip,
    *,
    speed: float | None = None,
    duration: float | None = None,
    reverse: bool = False,
    ping_pong: bool = False,
    offset: float = 0.0,
    tracks: frozenset[int] | None = None,
) -> Clip:
    """Return the clip with its time scaled, reversed, ping-ponged and shifted, in that order.

    Times are seconds of the clip, independent of a display's frame rate. Exact for every interpolation: values stay,
    tangents are divided by the time scale.

    speed: > 0; 0.25 takes four times as long. duration: seconds from first to last key, > 0. Not both.
    offset: seconds added to the clip's start, which otherwise is unchanged; the new start must not be below 0. A new
    start within half a millisecond of 0 becomes 0.
    Raises RangeError for values out of range, UnsupportedError if too many keys get the same time.
    (keys 0, 1 s; speed 0.25) → keys 0, 4 s
    """
    chosen = track_indices(clip, tracks)
    check_flags(reverse=reverse, ping_pong=ping_pong)
    if speed is not None and duration is not None:
        raise RangeError("`speed` and `duration` exclude each other")
    factor = _factor(clip, speed, duration)
    start, end = clip.start, clip.start + (clip.end - clip.start) * factor
    offset = _resolve_offset(check_number(offset, "offset"), start)
    _check_end(clip, end + offset + (end - start if ping_pong else 0.0))
    steps: list[Callable[[Track], Track]] = []
    if factor != 1:
        steps.append(lambda track: scale_time(track, start, factor))
    if offset:  # first, so that jumps are as short as float32 allows at their final times
        steps.append(lambda track: shift_time(track, offset))
    first, last = max(start + offset, 0.0), end + offset
    if reverse:
        steps.append(lambda track: reverse_track(track, first, last))
    if ping_pong:
        steps.append(lambda track: ping_pong_track(track, first, last))
    steps.append(_separate_keys)
    return Clip(clip.name, tuple(_all(steps, t) if i in chosen else t for i, t in enumerate(clip.tracks)))


def scale_time(track: Track, start: float, factor: float) -> Track:
    """Return the track with its times scaled by `factor` about `start`."""
    times = _keep_apart(start + (track.times - start) * factor)
    if track.in_tangents is None or track.out_tangents is None:
        return track.with_keys(times, track.values)
    return track.with_keys(times, track.values, track.in_tangents / factor, track.out_tangents / factor)


def shift_time(track: Track, offset: float) -> Track:
    """Return the track shifted by `offset` seconds."""
    return replace(track, time_axis=TimeAxis(_keep_apart(np.maximum(track.times + offset, 0.0))))


def reverse_track(track: Track, start: float, end: float) -> Track:
    """Return the track reversed between `start` and `end` (s, of the clip); reversing twice restores it.

    STEP keeps its value in each mirrored interval; its last value comes first, for the duration of a jump if the last
    key is at `end`.
    """
    times = _keep_apart(start + end - track.times[::-1])
    if track.interpolation is Interpolation.STEP:
        return _reverse_step(track, times, start)
    values = track.values[::-1]
    if track.in_tangents is None or track.out_tangents is None:
        return track.with_keys(times, values)
    return track.with_keys(times, values, -track.out_tangents[::-1], -track.in_tangents[::-1])


def ping_pong_track(track: Track, start: float, end: float) -> Track:
    """Return the track followed by itself reversed, from `end` to twice as far from `start` (s)."""
    if len(track.times) == 1:
        return track
    back = reverse_track(track, end, end)
    if track.interpolation is not Interpolation.STEP:
        return _concatenate(track, back, drop_first=bool(track.times[-1] == end))
    first_of_back = int(np.searchsorted(back.times, max(end, float(track.times[-1])), side="right"))
    return _concatenate(track, _without_start(back, first_of_back), drop_first=False)


def _all(steps: list[Callable[[Track], Track]], track: Track) -> Track:
    for step in steps:
        track = step(track)
    return track


def _separate_keys(track: Track) -> Track:
    """The track with jumps long enough for float32 at their new times."""
    times = separate_float32(track.times)
    return track if times is track.times else replace(track, time_axis=TimeAxis(times))


def _keep_apart(times: Floats) -> Floats:
    """Times that increase: those that rounding makes equal, such as 0 and 1e-45 s moved to 3 s, are a jump.

    Raises UnsupportedError for more of them than a jump has.
    """
    if (np.diff(times) > 0).all():
        return times
    apart = separate_float32(times)
    if not (steps := np.diff(apart) > 0).all():
        k = int(np.argmin(steps))
        raise UnsupportedError(
            f"keys {k} and {k + 1} would fall together, at {apart[k]:.9g} s",
            help="resample the clip: it has fewer keys",
        )
    return apart


def _check_end(clip: Clip, end: float) -> None:
    if end > max(MAX_END_S, clip.end):
        when = f"at {end:.3g} s" if math.isfinite(end) else "too late"
        raise RangeError(
            f"the clip would end {when} (limit {MAX_END_S:.0f} s, for times in float32)",
            help="gltf-anim trim shortens the clip, and moves a late start to 0 s"
            if clip.end > MAX_END_S
            else "choose a higher `speed`, or a shorter `duration` or `offset`",
        )


def _factor(clip: Clip, speed: float | None, duration: float | None) -> float:
    if speed is not None:
        speed = check_number(speed, "speed")
        if not 0 < speed <= MAX_SPEED:
            raise RangeError(
                f"`speed` is {speed:g} (expected above 0, at most {MAX_SPEED:g})",
                help="to play it backwards, use `reverse`",
            )
        return 1 / speed
    if duration is None:
        return 1.0
    duration = check_number(duration, "duration")
    if not (math.isfinite(duration) and duration >= MIN_DURATION_S):
        raise RangeError(f"`duration` is {duration:g} s (expected {MIN_DURATION_S:g} or more)")
    own = clip.end - clip.start
    if own == 0:
        raise RangeError("the clip has no duration, so it can't be stretched to one")
    return duration / own


def _resolve_offset(offset: float, start: float) -> float:
    """The offset, adjusted for a start at 0 s if the new start is within NEAR_ZERO_S of it."""
    if offset < 0 and abs(start + offset) < NEAR_ZERO_S:
        return -start
    if not start + offset >= 0:
        raise RangeError(
            f"an offset of {offset:g} s leads to {start + offset:g} s (glTF's time starts at 0)",
            help=f"an offset of {-start:.4f} moves the first key to 0 s" if start else "",
        )
    return offset


def _reverse_step(track: Track, times: Floats, start: float) -> Track:
    values = np.concatenate((track.values[-2::-1], track.values[:1]))
    if len(track.times) > 1 and (track.values[-1] != track.values[-2]).any():
        shown = start if times[0] > jump_time_after(start) else float(times[0])
        times = np.concatenate(([shown, max(float(times[0]), jump_time_after(shown))], times[1:]))
        values = np.concatenate((track.values[-1:], values))
    return track.with_keys(_keep_apart(times), values)


def _concatenate(track: Track, back: Track, *, drop_first: bool) -> Track:
    """Two tracks concatenated; equal end and start times become one key with the tangents of both sides."""
    skip = 1 if drop_first else 0
    times = np.concatenate((track.times, back.times[skip:]))
    values = np.concatenate((track.values, back.values[skip:]))
    if track.in_tangents is None or track.out_tangents is None:
        return track.with_keys(times, values)
    assert back.in_tangents is not None
    assert back.out_tangents is not None
    leaving, arriving = track.out_tangents.copy(), back.in_tangents.copy()
    if drop_first:
        leaving[-1] = back.out_tangents[0]
    else:
        leaving[-1], arriving[0] = 0.0, 0.0
    before, after = (track.in_tangents, arriving[skip:]), (leaving, back.out_tangents[skip:])
    return track.with_keys(times, values, np.concatenate(before), np.concatenate(after))


def _without_start(track: Track, first: int) -> Track:
    return track.with_keys(track.times[first:], track.values[first:])
