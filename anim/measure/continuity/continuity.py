"""Continuity of tracks at their keys: jumps of value, velocity and acceleration, by analysis.

The class of a key is the lowest derivative that is discontinuous there: the value (`jump`), the velocity (`C0`), the
acceleration (`C1`), or none of them (`C2`). `G1` is C0 on a smooth path: the direction is continuous, only the speed
along it jumps; values without a direction in space (weights, scalars) have no G1. A jump counts if it exceeds 0.001
of the track's own RMS speed or RMS acceleration, and the rounding of keys stored as float32 (or as normalized
integers). Two keys within one float32 step represent a jump and count as one key.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from anim.arrays import Bools, Floats
from anim.maths import quaternion
from anim.measure.continuity import knots
from anim.measure.continuity.knots import Knots, lengths
from anim.model import Clip, Interpolation, Skeleton, Track, ValueKind
from anim.sampling.times import FLOAT32_SPACING, MAX_JUMP_S

JUMP_TOLERANCE = 1e-3  # of the track's RMS speed or acceleration, or rad between two directions
CLOSED_GAP_PER_RANGE = 1e-3  # fraction of the track's range: largest difference of a loop's end from its start
INTEGER_STEPS = {5120: 1 / 127, 5121: 1 / 255, 5122: 1 / 32767, 5123: 1 / 65535}  # steps of normalized integers
UNITS = {"translation": "m", "rotation": "rad"}


class ContinuityClass(StrEnum):
    """Continuity of a track at a key, the lowest first."""

    JUMP = "jump"
    C0 = "C0"
    G1 = "G1"
    C1 = "C1"
    C2 = "C2"


@dataclass(frozen=True, slots=True)
class KeyJumps:
    """Jumps at I keys: times (I,) s, classes, and sizes (I,) of jumps of value, velocity, acceleration.

    In the track's unit, per second, and per second squared: lengths of difference vectors; radians for rotations.
    """

    times: Floats
    grades: tuple[ContinuityClass, ...]
    value: Floats
    speed: Floats
    acceleration: Floats


@dataclass(frozen=True, slots=True)
class MaxJump:
    """The largest jump of one kind, and its time."""

    size: float
    time_s: float


@dataclass(frozen=True, slots=True)
class LoopGap:
    """Continuity from the last key of the clip to its first: `jump` if the track is open, or steps."""

    grade: ContinuityClass
    value_jump: float
    speed_jump: float
    acceleration_jump: float


@dataclass(frozen=True, slots=True)
class TrackContinuity:
    """Continuity of one track.

    unit: of the value, "m", "rad" or "1"; of velocity per second, of acceleration per second².
    interior_keys: those between the first and the last, = jumps + c0 + g1 + c1 + c2. still: the track is constant.
    largest_*: None without a jump. seam: None for a constant track.
    """

    target: str
    path: str
    interpolation: str
    unit: str
    still: bool
    interior_keys: int
    jumps: int
    c0: int
    g1: int
    c1: int
    c2: int
    largest_value_jump: MaxJump | None
    largest_speed_jump: MaxJump | None
    largest_acceleration_jump: MaxJump | None
    seam: LoopGap | None
    keys: KeyJumps = field(repr=False)


def continuity(clip: Clip, skeleton: Skeleton) -> tuple[TrackContinuity, ...]:
    """Return the continuity of every track of the clip, in order."""
    return tuple(_track(track, clip, skeleton) for track in clip.tracks)


def at_keys(track: Track) -> KeyJumps:
    """Return the jumps at the interior keys of a track.

    Catmull-Rom through 0, 0.9, 0.2, 1 at 0, 1, 2, 3 s → C1 at 1 and 2 s, where the acceleration jumps by 3.1 per s²
    """
    return _Analysis(track).at_keys()


def _track(track: Track, clip: Clip, skeleton: Skeleton) -> TrackContinuity:
    analysis = _Analysis(track)
    keys = analysis.at_keys()
    count = {grade: keys.grades.count(grade) for grade in ContinuityClass}
    target = track.pointer if track.node is None else skeleton.display_name(track.node)
    return TrackContinuity(
        target=target or "",
        path=track.path,
        interpolation=str(track.interpolation),
        unit="rad" if track.kind is ValueKind.ROTATION else UNITS.get(track.path, "1"),
        still=analysis.is_constant,
        interior_keys=len(keys.times),
        jumps=count[ContinuityClass.JUMP],
        c0=count[ContinuityClass.C0],
        g1=count[ContinuityClass.G1],
        c1=count[ContinuityClass.C1],
        c2=count[ContinuityClass.C2],
        largest_value_jump=_max_jump(keys, keys.value, {ContinuityClass.JUMP}),
        largest_speed_jump=_max_jump(keys, keys.speed, {ContinuityClass.JUMP, ContinuityClass.C0, ContinuityClass.G1}),
        largest_acceleration_jump=_max_jump(keys, keys.acceleration, set(ContinuityClass) - {ContinuityClass.C2}),
        seam=None if analysis.is_constant else analysis.loop_gap(clip.start, clip.end),
        keys=keys,
    )


def _max_jump(keys: KeyJumps, sizes: Floats, among: set[ContinuityClass]) -> MaxJump | None:
    """The largest jump at keys of these classes."""
    counted = np.where([grade in among for grade in keys.grades], sizes, 0.0)
    if not counted.any():
        return None
    at = int(counted.argmax())
    return MaxJump(float(counted[at]), float(keys.times[at]))


class _Analysis:
    """One track with its scales: RMS speed and acceleration, and the step of its stored values."""

    def __init__(self, track: Track) -> None:
        self.track = track
        self.is_constant = _is_constant(track)
        self._speed, self._acceleration = (0.0, 0.0) if self.is_constant else knots.root_mean_squares(track)
        self._size = float(np.abs(track.values).max())
        storage = track.storage
        integer_step = INTEGER_STEPS.get(storage.component_type, 1.0)
        self._step = integer_step if storage.normalized else FLOAT32_SPACING * self._size
        self._late = FLOAT32_SPACING * float(track.times[-1])

    def at_keys(self) -> KeyJumps:
        """The jumps at the interior keys; two keys that represent a jump are one, at the time of the second."""
        if self.is_constant:
            none = np.zeros(max(len(self.track.times) - 2, 0))
            return KeyJumps(self.track.times[1:-1], (ContinuityClass.C2,) * len(none), none, none, none)
        return self._graded(knots.interior_knots(self.track), 0.0)

    def loop_gap(self, start: float, end: float) -> LoopGap:
        """The jump from the clip's end to its start; of the two of a STEP track the larger one."""
        found = self._graded(knots.loop_knot(self.track, start=start, end=end), CLOSED_GAP_PER_RANGE * self._range())
        worst = int(found.value.argmax())
        sizes = (float(each[worst]) for each in (found.value, found.speed, found.acceleration))
        return LoopGap(found.grades[worst], *sizes)

    def _graded(self, at: Knots, allowed: float) -> KeyJumps:
        """The jumps at knots with their classes; values may differ by `allowed` and rounding."""
        speed = lengths(at.rates[1] - at.rates[0])
        acceleration = lengths(at.accelerations[1] - at.accelerations[0])
        if self.track.kind is ValueKind.ROTATION:
            value = quaternion.angle_between(*(quaternion.normalize(values) for values in at.values))
        else:
            value = lengths(at.values[1] - at.values[0])
        allowed_speed = JUMP_TOLERANCE * self._speed + self._speed_noise(at)
        grades = np.full(len(value), str(ContinuityClass.C2), dtype="U4")
        grades[acceleration > JUMP_TOLERANCE * self._acceleration + self._acceleration_noise(at)] = ContinuityClass.C1
        grades[speed > allowed_speed] = ContinuityClass.C0
        grades[(speed > allowed_speed) & self._is_continued(at, allowed_speed)] = ContinuityClass.G1
        grades[value > allowed + self._value_noise(at)] = ContinuityClass.JUMP
        return KeyJumps(at.times, tuple(ContinuityClass(str(each)) for each in grades), value, speed, acceleration)

    def _is_continued(self, at: Knots, allowed_speed: Floats) -> Bools:
        """Mask of knots where the track moves on both sides in one direction; weights and scalars have none."""
        if self.track.path == "weights" or self.track.values.shape[1] == 1:
            return np.zeros(len(at.times), np.bool_)
        before, after = (lengths(rates) for rates in at.rates)
        moving = np.minimum(before, after) > allowed_speed
        one, other = (
            rates / np.where(length > 0, length, 1.0)[:, None]
            for rates, length in zip(at.rates, (before, after), strict=True)
        )
        return np.asarray(moving & (lengths(other - one) <= JUMP_TOLERANCE))

    def _value_noise(self, at: Knots) -> Floats:
        """Difference of values on both sides of two keys without a jump: rounding, and motion between them."""
        speed = np.maximum(*(lengths(rates) for rates in at.rates))
        return np.asarray(8 * FLOAT32_SPACING * self._size + 2 * (MAX_JUMP_S + 2 * self._late) * speed)

    def _speed_noise(self, at: Knots) -> Floats:
        """Uncertainty of velocities from the rounding of values and times, for LINEAR; tangents are stored."""
        noise = np.zeros(len(at.times))
        for rates, h in zip(at.rates, at.durations, strict=True):
            speed = lengths(rates)
            noise += 8 * FLOAT32_SPACING * speed
            if self.track.interpolation is Interpolation.LINEAR:
                noise += (4 * self._step + 2 * self._late * speed) / h
        return noise

    def _acceleration_noise(self, at: Knots) -> Floats:
        """Uncertainty of a cubic's accelerations from the rounding of stored values, tangents and times."""
        noise = np.zeros(len(at.times))
        if self.track.interpolation is not Interpolation.CUBICSPLINE:
            return noise
        for rates, accelerations, h in zip(at.rates, at.accelerations, at.durations, strict=True):
            relative = FLOAT32_SPACING + self._late / h
            noise += 12 * self._step / h**2 + relative * (12 * lengths(rates) / h + 4 * lengths(accelerations))
        return noise

    def _range(self) -> float:
        values = self.track.values
        if self.track.kind is ValueKind.ROTATION:
            unit = quaternion.normalize(values)
            return float(quaternion.angle_between(unit, unit[:1]).max())
        return float(lengths(values.max(axis=0) - values.min(axis=0)))


def _is_constant(track: Track) -> bool:
    """Return whether a track is constant: one value, and no tangents other than 0."""
    tangents = (track.in_tangents, track.out_tangents)
    same = bool((track.values == track.values[0]).all())
    return same and (len(track.times) == 1 or not any(each is not None and each.any() for each in tangents))
