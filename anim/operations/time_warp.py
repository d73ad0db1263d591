"""A clip run through at another tempo: new time → old time by a map that may slow down, race, stop or turn back."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from anim.arrays import Floats, unique_sorted
from anim.curves.easing import table
from anim.curves.easing.function import CubicSegment, Easing, evaluate
from anim.curves.fitting import adaptive_keys
from anim.curves.fitting.easing_fit import fit_segments
from anim.errors import RangeError
from anim.model import Clip, Interpolation, Track, ValueKind
from anim.operations.cubic_segments import with_keys
from anim.operations.ease_track import slope
from anim.sampling import segment
from anim.sampling.derivatives import rates
from anim.sampling.times import distinct_float32
from anim.sampling.track import sample

TOLERANCE = 1e-3  # of a track's range, where no cubic is exact
ANGLE_TOLERANCE = math.radians(0.05)
HALVINGS = 60  # of the search for the moment at which the map reaches a key
SNAP = 1e-10  # s; the search for a key's moment ends nearer than this
MIN_TOLERANCE = 2e-7  # of an ease; float64 fits get no nearer


def warp(
    clip: Clip,
    *,
    easing: Easing | str,
    start: float | None = None,
    end: float | None = None,
    tolerance: float = TOLERANCE,
    angle_tolerance: float = ANGLE_TOLERANCE,
    interpolation: str = "cubicspline",
    tracks: frozenset[int] | None = None,
) -> Clip:
    """Return the clip with one ease over a whole range: at start + u·d it shows what it showed at start + e(u)·d.

    easing: one of EASINGS, or a text that names it: "sine-in-out".
    start, end: seconds, by default the clip's own; before and after nothing changes. An ease that overshoots runs into
    the motion beyond the range and back; beyond the clip's ends it holds.
    STEP keys move to where the map reaches them, exactly. Others become CUBICSPLINE: exact for LINEAR vectors under a
    cubic ease, within `tolerance` (share of a track's range) or `angle_tolerance` (rad) elsewhere; with interpolation
    "linear" LINEAR, within the same.
    Raises RangeError for an empty range, or an ease that jumps.
    """
    easing = table.parse(easing) if isinstance(easing, str) else easing
    first = clip.start if start is None else start
    last = clip.end if end is None else end
    if easing.stepped:
        raise RangeError(f"'{easing.name}' jumps, and time can't")
    if not last > first:
        raise RangeError(f"the range from {first:g} s to {last:g} s is empty")
    chosen = tracks if tracks is not None else frozenset(range(len(clip.tracks)))
    new = []
    corners: dict[
        tuple[int, tuple[CubicSegment, ...]], Floats
    ] = {}  # tracks on one time axis under one map share the search for keys
    for i, track in enumerate(clip.tracks):
        if i not in chosen or len(track.times) == 1 or not _moves(track):
            new.append(track)
            continue
        allowed = (
            angle_tolerance
            if track.kind is ValueKind.ROTATION
            else adaptive_keys.float32_tolerance(track, tolerance * _extent(track))
        )
        times = _map(track, easing, first, last, allowed)
        key = (id(track.times), times.cubics)
        if key not in corners:
            reached = times.reaching(track.times)
            corners[key] = reached[distinct_float32(reached)]
        new.append(_warped(track, times, corners[key], allowed, interpolation))
    return Clip(clip.name, tuple(new))


@dataclass(frozen=True, slots=True)
class TimeMap:
    """New time → old time: an ease between start and end, in seconds, and the same time elsewhere.

    cubics: the ease, or what follows it closely. value: what counts: that of the cubics, or the ease's own.
    """

    cubics: tuple[CubicSegment, ...]
    value: Callable[[Floats], Floats]
    start: float
    end: float

    def old(self, times: Floats) -> Floats:
        """Return the old times (F,) that new times (F,) show."""
        u = (times - self.start) / (self.end - self.start)
        inside = (u >= 0) & (u <= 1)
        eased = self.start + (self.end - self.start) * self.value(np.clip(u, 0, 1))
        return np.where(inside, eased, times)

    def speed(self, times: Floats, *, before: bool) -> Floats:
        """Return old seconds per new second (F,), just before or just after each time; negative while it runs back."""
        u = (times - self.start) / (self.end - self.start)
        inside = (u > 0) & (u <= 1) if before else (u >= 0) & (u < 1)
        return np.where(inside, slope(self.cubics, np.clip(u, 0, 1), before=before), 1.0)

    def reaching(self, keys: Floats) -> Floats:
        """Return the new times at which the map reaches one of the old times `keys` (K,), and its pieces' ends."""
        found = [keys[(keys <= self.start) | (keys >= self.end)], np.array([self.start, self.end])]
        duration = self.end - self.start
        for low, high in _monotone(self.cubics):
            ends = self.start + duration * np.array([low, high])
            found.append(ends)
            a, b = self.start + duration * self.value(np.array([low, high]))
            within = keys[(keys > min(a, b)) & (keys < max(a, b))]
            shares = (within - self.start) / duration
            found.append(self.start + duration * _inverse(self.value, low, high, shares, rising=bool(b > a)))
        return unique_sorted(np.concatenate(found))


def _map(track: Track, easing: Easing, start: float, end: float, allowed: float) -> TimeMap:
    """The map for one track: an ease that is no cubic is followed so closely that its error stays half of `allowed`."""
    if track.interpolation is Interpolation.STEP:
        return TimeMap(fit_segments(easing, tolerance=TOLERANCE), easing.value, start, end)
    near = allowed / 2 / max(segment.max_rate_per_second(track) * (end - start), allowed)
    near = 2.0 ** math.floor(math.log2(max(near, MIN_TOLERANCE)))  # few different fits for many tracks
    cubics = fit_segments(easing, tolerance=max(near, MIN_TOLERANCE))
    return TimeMap(cubics, lambda u: evaluate(cubics, u), start, end)


def _moves(track: Track) -> bool:
    changes = (track.values != track.values[0]).any()
    return bool(changes) or (track.in_tangents is not None and segment.max_rate_per_second(track) > 0)


def _warped(track: Track, times: TimeMap, corners: Floats, allowed: float, interpolation: str) -> Track:
    old = times.old(corners)
    inside = (old >= track.times[0] - 1e-9) & (old <= track.times[-1] + 1e-9)
    corners = corners[inside | np.append(inside[1:], False) | np.insert(inside[:-1], 0, False)]
    if track.interpolation is Interpolation.STEP:
        values = sample(track, times.old(np.append((corners[:-1] + corners[1:]) / 2, corners[-1])))
        return _without_repeats(with_keys(track, corners, values, Interpolation.STEP))
    motion = _motion(track, times)
    if interpolation == "linear":
        keys = adaptive_keys.linear_keys(motion, corners, tolerance=allowed / 2)
        return with_keys(track, keys.times, keys.values, Interpolation.LINEAR)
    return adaptive_keys.to_cubicspline(track, adaptive_keys.cubic_keys(motion, corners, tolerance=allowed / 2))


def _motion(track: Track, times: TimeMap) -> adaptive_keys.TrackFunction:
    def values(at: Floats) -> Floats:
        return sample(track, _snapped(times.old(at), track.times))

    def changes(at: Floats, before: bool) -> Floats:
        tempo = times.speed(at, before=before)
        old = _snapped(times.old(at), track.times)
        # running forward, just before in new time is just before in old time; running back it is just after
        forward, back = rates(track, old, before=before), rates(track, old, before=not before)
        return np.asarray(np.where((tempo >= 0)[:, None], forward, back) * tempo[:, None])

    return adaptive_keys.TrackFunction(values, changes, track.kind is ValueKind.ROTATION)


def _snapped(times: Floats, keys: Floats) -> Floats:
    """Times, those that only rounding keeps from a key put on it: there, before and after differ."""
    near = keys[np.clip(np.searchsorted(keys, times - SNAP), 0, len(keys) - 1)]
    return np.where(np.abs(near - times) <= SNAP, near, times)


def _without_repeats(track: Track) -> Track:
    """STEP keys that change nothing go, but for the first and the last."""
    changed = np.concatenate(([True], (np.diff(track.values, axis=0) != 0).any(axis=1)))
    changed[-1] = True
    return replace(track, times=track.times[changed], values=track.values[changed])


def _extent(track: Track) -> float:
    extent = float((track.values.max(axis=0) - track.values.min(axis=0)).max())
    return extent or 1.0


def _monotone(cubics: Sequence[CubicSegment]) -> list[tuple[float, float]]:
    """The parts of u between which the ease only rises or only falls, in order."""
    parts: list[tuple[float, float]] = []
    for p in cubics:
        length = p.end - p.start
        a, b = length * p.slope0, length * p.slope1
        rise = p.value1 - p.value0
        # slope of the cubic over its own share w: a + (6·rise − 4a − 2b) w + 3 (a + b − 2·rise) w²
        roots = np.roots([3 * (a + b - 2 * rise), 6 * rise - 4 * a - 2 * b, a])
        turns = sorted(float(w.real) for w in roots if abs(w.imag) < 1e-12 and 0 < w.real < 1)
        edges = [p.start, *(p.start + w * length for w in turns), p.end]
        parts += pairwise(edges)
    return parts


def _inverse(value: Callable[[Floats], Floats], low: float, high: float, shares: Floats, *, rising: bool) -> Floats:
    """The u between low and high, where the ease only rises or only falls, at which it has the values `shares`."""
    a, b = np.full(len(shares), low), np.full(len(shares), high)
    for _ in range(HALVINGS):
        middle = (a + b) / 2
        below = (value(middle) < shares) == rising
        a, b = np.where(below, middle, a), np.where(below, b, middle)
    return np.asarray((a + b) / 2)
