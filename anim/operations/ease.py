"""Easing of the segments between keys."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from anim.arguments import positive
from anim.arrays import Bools, Floats, Identity
from anim.curves.easing import table
from anim.curves.easing.function import Easing
from anim.curves.fitting.adaptive_keys import TrackFunction, cubic_keys, float32_tolerance, linear_keys
from anim.curves.fitting.easing_fit import fit_linear, fit_segments
from anim.errors import DataRangeError, RangeError, check_number, check_type
from anim.model import Clip, Interpolation, Track, ValueKind
from anim.operations.cubic_segments import to_cubicspline, to_step, with_distinct_keys
from anim.operations.ease_track import EasedTrack, ease_segments, ease_steps
from anim.operations.selection import track_indices
from anim.sampling import segment

TOLERANCE = 1e-3  # of a segment's range
ANGLE_TOLERANCE_RAD = math.radians(0.05)
OUTPUTS = ("cubicspline", "linear")
MIN_TOLERANCE = 2e-7  # of an easing; limit of fits in float64
MAX_COMPARED_BYTES = 1 << 16  # of values of tracks that are compared; of longer ones only shared arrays are equal
EDGE_TOLERANCE_S = 1e-6  # s; a segment that starts less than this before `start` counts as inside


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Tolerances for non-cubic easings: fraction of a segment's range, and radians for rotations."""

    fraction: float = TOLERANCE
    angle: float = ANGLE_TOLERANCE_RAD

    def __post_init__(self) -> None:
        object.__setattr__(self, "fraction", positive(self.fraction, "tolerance"))
        object.__setattr__(self, "angle", positive(self.angle, "angle_tolerance"))


def ease(
    clip: Clip,
    *,
    easing: Easing | str,
    start: float = -math.inf,
    end: float = math.inf,
    tolerances: Tolerances = Tolerances(),
    interpolation: str = "cubicspline",
    tracks: frozenset[int] | None = None,
) -> Clip:
    """Return the clip with every segment between keys eased: same keys, same path, new speed.

    A segment from v0 to v1 becomes v0 + e(u)(v1 − v0); rotations follow the slerp arc to the fraction e(u) of its
    angle, and a CUBICSPLINE segment is evaluated at e(u). Easings that overshoot extrapolate beyond the keys. STEP
    tracks and tracks with one key are unchanged, and so is the shape of segments outside the range.

    easing: one of EASINGS, or its name as text: "smoothstep", "cubic-bezier(.2, 0, 0, 1)".
    start, end: seconds; only segments between are eased.
    interpolation: "cubicspline", exact for cubic easings, or "linear". Steps become STEP, or jumps within one float32
    interval if only a part is eased.
    tracks: indices of the tracks to ease, None for all. Raises RangeError for another interpolation, or an empty range.
    (keys 0, 1 s: 0, 1; quad-in) → keys 0, 1 s with in tangent 2 at 1 s
    """
    chosen = track_indices(clip, tracks)
    check_output(interpolation)
    easing = table.parse(easing) if isinstance(easing, str) else easing
    check_type(easing, Easing, "easing", help="anim.EASINGS has their names")
    check_type(tolerances, Tolerances, "tolerances")
    start, end = check_number(start, "start"), check_number(end, "end")
    if not end > start:
        raise RangeError(f"the range from {start:g} s to {end:g} s is empty")
    job = _Job(easing, start, end, tolerances, interpolation, easing.extent)
    made: dict[object, tuple[Track, Track]] = {}  # many tracks are equal but for their node, as constant scales
    new = list(clip.tracks)
    for i in sorted(chosen):
        track = new[i]
        keys = _compared(track)
        if keys not in made:
            made[keys] = track, job.eased(track)
        new[i] = _repeat(track, *made[keys])
    return Clip(clip.name, tuple(new))


def check_output(interpolation: str) -> None:
    """Raise RangeError unless eased keys can have this interpolation."""
    if interpolation not in OUTPUTS:
        raise RangeError(f"`interpolation` is '{interpolation}' (expected one of {', '.join(OUTPUTS)})")


def _compared(track: Track) -> tuple[object, ...]:
    """All that easing depends on."""
    parts = (track.values, track.in_tangents, track.out_tangents)
    if track.values.nbytes > MAX_COMPARED_BYTES:
        return track.time_axis, track.interpolation, track.kind, Identity(*parts)
    keys = (None if part is None else part.tobytes() for part in parts)
    return track.time_axis, track.interpolation, track.kind, track.values.shape, *keys


def _repeat(track: Track, equal: Track, eased: Track) -> Track:
    """A track after the change that made `eased` of one that is equal but for its target."""
    if eased is equal:
        return track
    if equal is track:
        return eased
    keys = (eased.time_axis, eased.values, eased.in_tangents, eased.out_tangents)
    return track.with_keys(*keys, interpolation=eased.interpolation)


@dataclass(frozen=True, slots=True)
class _Job:
    easing: Easing
    start: float
    end: float
    tolerances: Tolerances
    interpolation: str
    extent: tuple[float, float]

    def eased(self, track: Track) -> Track:
        inside = (track.times[:-1] >= self.start - EDGE_TOLERANCE_S) & (track.times[1:] <= self.end + EDGE_TOLERANCE_S)
        if track.interpolation is Interpolation.STEP or not inside.any() or self.easing.name == "linear":
            return track
        if self.easing.stepped:
            pieces = ease_steps(track, inside, self.easing, angle_tolerance=self.tolerances.angle)
            return to_step(track, pieces) if inside.all() else to_cubicspline(track, pieces)
        straight = track.interpolation is Interpolation.LINEAR
        if self.interpolation == "linear":
            lines = straight and track.kind is not ValueKind.ROTATION
            return self._lines(track, inside) if lines else self._sampled(track, inside)
        return self._exact(track, inside) if straight else self._followed(track, inside)

    def _exact(self, track: Track, inside: Bools) -> Track:
        tolerances = (self.tolerances.fraction, self.tolerances.angle)
        return to_cubicspline(track, ease_segments(track, inside, self.easing, *tolerances))

    def _lines(self, track: Track, inside: Bools) -> Track:
        u = fit_linear(self.easing.value, self.easing.breakpoints, self.tolerances.fraction)[1:-1]
        shares = self.easing.value(u)
        times, values = [track.times[:1]], [track.values[:1]]
        for k in range(len(track.times) - 1):
            if inside[k]:
                times.append(track.times[k] + (track.times[k + 1] - track.times[k]) * u)
                values.append(segment.evaluate(track, np.full(len(u), k), shares))
            times.append(track.times[k + 1 : k + 2])
            values.append(track.values[k + 1 : k + 2])
        return with_distinct_keys(track, np.concatenate(times), np.concatenate(values), Interpolation.LINEAR)

    def _followed(self, track: Track, inside: Bools) -> Track:
        motion, corners, tolerance = self._motion(track, inside)
        return cubic_keys(track, motion, corners, tolerance=tolerance)

    def _sampled(self, track: Track, inside: Bools) -> Track:
        motion, corners, tolerance = self._motion(track, inside)
        return with_distinct_keys(track, *linear_keys(motion, corners, tolerance=tolerance), Interpolation.LINEAR)

    def _motion(self, track: Track, inside: Bools) -> tuple[TrackFunction, Floats, float]:
        """The eased track as functions of time, its non-smooth times, and the tolerance of its approximation."""
        allowed, speed = self._allowed(track, inside)
        near = max(allowed / 2 / max(speed, allowed), MIN_TOLERANCE)
        if not math.isfinite(near):
            raise DataRangeError("its speed is not finite (a spline through a rotation of 0, or very large values)")
        near = 2.0 ** math.floor(math.log2(near))  # rounded, so that many tracks share few fits
        cubics = fit_segments(self.easing, tolerance=max(near, MIN_TOLERANCE))
        breaks = np.array([p.start for p in cubics[1:]])
        starts, durations = track.times[:-1][inside], np.diff(track.times)[inside]
        corners = np.concatenate((track.times, (starts[:, None] + durations[:, None] * breaks).reshape(-1)))
        eased = EasedTrack(track, inside, cubics)
        return (
            TrackFunction(eased.values, track.kind is ValueKind.ROTATION, eased.rates),
            np.sort(corners),
            allowed / 2,
        )

    def _allowed(self, track: Track, inside: Bools) -> tuple[float, float]:
        """Tolerance of the keys, and greatest derivative per u of the easing's extent, which multiplies its error."""
        speed = segment.max_rate(track, np.flatnonzero(inside), extent=self.extent)
        if track.kind is ValueKind.ROTATION:
            return self.tolerances.angle, speed
        ranges = np.abs(np.diff(track.values, axis=0)).max(axis=1)[inside]
        moving = ranges[ranges > 0]
        return float32_tolerance(track, self.tolerances.fraction * float(moving.min() if len(moving) else 1.0)), speed
