"""Time warp of clips: new time → old time by a map of any speed, zero and negative included."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from anim.arguments import positive
from anim.arrays import Floats, unique_sorted
from anim.curves.easing import table
from anim.curves.easing.function import CubicSegment, Easing, evaluate
from anim.curves.fitting.adaptive_keys import TrackFunction, cubic_keys, float32_tolerance, linear_keys
from anim.curves.fitting.easing_fit import fit_segments
from anim.errors import DataRangeError, RangeError, check_number, check_type
from anim.model import Clip, Interpolation, TimeAxis, Track, ValueKind
from anim.operations.cubic_segments import with_distinct_keys
from anim.operations.ease import check_output
from anim.operations.ease_track import slope
from anim.operations.selection import track_indices
from anim.sampling import segment
from anim.sampling.derivatives import rates
from anim.sampling.times import distinct_float32
from anim.sampling.track import sample

TOLERANCE = 1e-3  # of a track's range, if no cubic is exact
ANGLE_TOLERANCE_RAD = math.radians(0.05)
MAX_RANGE_S = 1e15  # beyond, float64 resolves no time of a clip
MAX_HALVINGS = 60  # of the search for the time at which the map reaches a key
SNAP_TOLERANCE_S = 1e-10  # s; error of the search for a key's time
MIN_TOLERANCE = 2e-7  # of an easing; limit of fits in float64


def warp(
    clip: Clip,
    *,
    easing: Easing | str,
    start: float | None = None,
    end: float | None = None,
    tolerance: float = TOLERANCE,
    angle_tolerance: float = ANGLE_TOLERANCE_RAD,
    interpolation: str = "cubicspline",
    tracks: frozenset[int] | None = None,
) -> Clip:
    """Return the clip with its time eased over a range: the pose at start + u·d is from start + e(u)·d.

    easing: one of EASINGS, or its name as text: "sine-in-out".
    start, end: seconds, by default the clip's own; outside nothing changes. An easing that overshoots reaches the
    motion outside the range, clamped to the clip's ends.
    STEP keys move exactly to the times at which the map reaches them. Others become CUBICSPLINE: exact for LINEAR
    vectors under a cubic easing, otherwise within `tolerance` (fraction of a track's range) or `angle_tolerance` (rad);
    with interpolation "linear" LINEAR, within the same.
    Raises RangeError for an empty or endless range, or an easing that jumps.
    """
    chosen = track_indices(clip, tracks)
    easing = table.parse(easing) if isinstance(easing, str) else easing
    check_type(easing, Easing, "easing", help="anim.EASINGS has their names")
    check_output(interpolation)
    tolerance, angle_tolerance = positive(tolerance, "tolerance"), positive(angle_tolerance, "angle_tolerance")
    first = clip.start if start is None else check_number(start, "start")
    last = clip.end if end is None else check_number(end, "end")
    if easing.stepped:
        raise RangeError(f"'{easing.name}' jumps, and time can't")
    if not last > first:
        raise RangeError(f"the range from {first:g} s to {last:g} s is empty")
    if last - first > MAX_RANGE_S:
        kind = DataRangeError if clip.end - clip.start > MAX_RANGE_S else RangeError
        raise kind(f"the range from {first:g} s to {last:g} s is too long (limit {MAX_RANGE_S:g} s)")
    new = []
    corners: dict[tuple[TimeAxis, tuple[CubicSegment, ...]], Floats] = {}  # equal for equal axes and maps
    for i, track in enumerate(clip.tracks):
        if i not in chosen or len(track.times) == 1 or not _moves(track):
            new.append(track)
            continue
        allowed = (
            angle_tolerance
            if track.kind is ValueKind.ROTATION
            else float32_tolerance(track, tolerance * _extent(track))
        )
        times = _build_map(track, easing, first, last, allowed)
        key = (track.time_axis, times.cubics)
        if key not in corners:
            reached = times.reaching(track.times)
            corners[key] = reached[distinct_float32(reached)]
        new.append(_warp_track(track, times, corners[key], allowed, interpolation))
    return Clip(clip.name, tuple(new))


@dataclass(frozen=True, slots=True)
class TimeMap:
    """Map from new to old time: an easing between start and end, in seconds, and the identity elsewhere.

    cubics: the easing, or its approximation. value: function of the map: of the cubics, or of the easing itself.
    """

    cubics: tuple[CubicSegment, ...]
    value: Callable[[Floats], Floats]
    start: float
    end: float

    def old(self, times: Floats) -> Floats:
        """Return the old times (F,) of new times (F,)."""
        u = (times - self.start) / (self.end - self.start)
        inside = (u >= 0) & (u <= 1)
        eased = self.start + (self.end - self.start) * self.value(np.clip(u, 0, 1))
        return np.where(inside, eased, times)

    def speed(self, times: Floats, *, before: bool) -> Floats:
        """Return old seconds per new second (F,), just before or just after each time; negative in reverse."""
        u = (times - self.start) / (self.end - self.start)
        inside = (u > 0) & (u <= 1) if before else (u >= 0) & (u < 1)
        return np.where(inside, slope(self.cubics, np.clip(u, 0, 1), before=before), 1.0)

    def reaching(self, keys: Floats) -> Floats:
        """Return the new times of the old times `keys` (K,), and the ends of the map's segments."""
        found = [keys[(keys <= self.start) | (keys >= self.end)], np.array([self.start, self.end])]
        duration = self.end - self.start
        for low, high in _monotonic_intervals(self.cubics):
            ends = self.start + duration * np.array([low, high])
            found.append(ends)
            a, b = self.start + duration * self.value(np.array([low, high]))
            within = keys[(keys > min(a, b)) & (keys < max(a, b))]
            shares = (within - self.start) / duration
            found.append(self.start + duration * _inverse(self.value, low, high, shares, rising=bool(b > a)))
        return unique_sorted(np.concatenate(found))


def _build_map(track: Track, easing: Easing, start: float, end: float, allowed: float) -> TimeMap:
    """The map for one track; the fit of a non-cubic easing takes at most half of `allowed`."""
    if track.interpolation is Interpolation.STEP:
        return TimeMap(fit_segments(easing, tolerance=TOLERANCE), easing.value, start, end)
    near = allowed / 2 / max(segment.max_rate_per_second(track) * (end - start), allowed)
    if not math.isfinite(near):
        raise DataRangeError("its speed is not finite (a spline through a rotation of 0, or very large values)")
    near = 2.0 ** math.floor(math.log2(max(near, MIN_TOLERANCE)))  # rounded, so that many tracks share few fits
    cubics = fit_segments(easing, tolerance=max(near, MIN_TOLERANCE))
    return TimeMap(cubics, lambda u: evaluate(cubics, u), start, end)


def _moves(track: Track) -> bool:
    changes = (track.values != track.values[0]).any()
    return bool(changes) or (track.in_tangents is not None and segment.max_rate_per_second(track) > 0)


def _warp_track(track: Track, times: TimeMap, corners: Floats, allowed: float, interpolation: str) -> Track:
    old = times.old(corners)
    inside = (old >= track.times[0] - 1e-9) & (old <= track.times[-1] + 1e-9)
    corners = corners[inside | np.append(inside[1:], False) | np.insert(inside[:-1], 0, False)]
    if track.interpolation is Interpolation.STEP:
        values = sample(track, times.old(np.append((corners[:-1] + corners[1:]) / 2, corners[-1])))
        return _remove_repeats(with_distinct_keys(track, corners, values, Interpolation.STEP))
    motion = _motion(track, times)
    if interpolation == "linear":
        return with_distinct_keys(track, *linear_keys(motion, corners, tolerance=allowed / 2), Interpolation.LINEAR)
    return cubic_keys(track, motion, corners, tolerance=allowed / 2)


def _motion(track: Track, times: TimeMap) -> TrackFunction:
    def values(at: Floats, before: bool) -> Floats:
        return sample(track, _snap_to_keys(times.old(at), track.times))

    def changes(at: Floats, before: bool) -> Floats:
        tempo = times.speed(at, before=before)
        old = _snap_to_keys(times.old(at), track.times)
        # forward, just before in new time is just before in old time; in reverse it is just after
        forward, back = rates(track, old, before=before), rates(track, old, before=not before)
        return np.asarray(np.where((tempo >= 0)[:, None], forward, back) * tempo[:, None])

    return TrackFunction(values, track.kind is ValueKind.ROTATION, changes)


def _snap_to_keys(times: Floats, keys: Floats) -> Floats:
    """Times, those within rounding of a key moved to the key, where one-sided derivatives differ."""
    near = keys[np.clip(np.searchsorted(keys, times - SNAP_TOLERANCE_S), 0, len(keys) - 1)]
    return np.where(np.abs(near - times) <= SNAP_TOLERANCE_S, near, times)


def _remove_repeats(track: Track) -> Track:
    """The STEP track without redundant keys, except for the first and the last."""
    changed = np.concatenate(([True], (np.diff(track.values, axis=0) != 0).any(axis=1)))
    changed[-1] = True
    return track.with_keys(track.times[changed], track.values[changed])


def _extent(track: Track) -> float:
    extent = float((track.values.max(axis=0) - track.values.min(axis=0)).max())
    return extent or 1.0


def _monotonic_intervals(cubics: Sequence[CubicSegment]) -> list[tuple[float, float]]:
    """Monotonic intervals of u of the easing, in order."""
    parts: list[tuple[float, float]] = []
    for p in cubics:
        length = p.end - p.start
        a, b = length * p.slope0, length * p.slope1
        rise = p.value1 - p.value0
        # slope of the cubic over its own parameter w: a + (6·rise − 4a − 2b) w + 3 (a + b − 2·rise) w²
        roots = np.roots([3 * (a + b - 2 * rise), 6 * rise - 4 * a - 2 * b, a])
        turns = sorted(float(w.real) for w in roots if abs(w.imag) < 1e-12 and 0 < w.real < 1)
        edges = [p.start, *(p.start + w * length for w in turns), p.end]
        parts += pairwise(edges)
    return parts


def _inverse(value: Callable[[Floats], Floats], low: float, high: float, shares: Floats, *, rising: bool) -> Floats:
    """The u at which the easing, monotonic between low and high, has the values `shares`."""
    a, b = np.full(len(shares), low), np.full(len(shares), high)
    for _ in range(MAX_HALVINGS):
        middle = (a + b) / 2
        below = (value(middle) < shares) == rising
        a, b = np.where(below, middle, a), np.where(below, b, middle)
    return np.asarray((a + b) / 2)
