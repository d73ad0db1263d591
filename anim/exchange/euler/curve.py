"""Animation curve: a scalar with its own keys, as in Maya and FBX, and its evaluation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from anim import arrays
from anim.arrays import Floats, Ints
from anim.errors import RangeError, ShapeError
from anim.maths import bezier, hermite
from anim.model.time_axis import TimeAxis, as_time_axis

WEIGHTS = ("in_weights", "out_weights")
DEFAULT_WEIGHT = 1 / 3  # of a segment; with both handles of this length the cubic equals `maths.hermite`
HANDLES = ("in_tangents", "out_tangents", *WEIGHTS)


class Mode(IntEnum):
    """Interpolation from a key to the next."""

    STEP = 0
    LINEAR = 1
    CUBIC = 2


CUBIC = int(Mode.CUBIC)
MODES = {mode.name.lower(): mode for mode in Mode}


class Keys(NamedTuple):
    """Keys of one curve, or of several ones after each other (S in all): the fields of `Curve`, all (S,)."""

    times: Floats
    values: Floats
    modes: NDArray[np.uint8]
    in_tangents: Floats | None = None
    out_tangents: Floats | None = None
    in_weights: Floats | None = None
    out_weights: Floats | None = None

    def weights(self, left: Ints, right: Ints) -> tuple[Floats | float, Floats | float]:
        """Return the handle lengths after keys `left` and before keys `right`, as fractions of the segment."""
        leaving = DEFAULT_WEIGHT if self.out_weights is None else self.out_weights[left]
        arriving = DEFAULT_WEIGHT if self.in_weights is None else self.in_weights[right]
        return leaving, arriving


@dataclass(frozen=True, slots=True)
class Curve:
    """Keys of a scalar, constant before the first and after the last key.

    time_axis: K key times. values: (K,) radians, metres or factors.
    modes: (K,) Mode after each key. in_tangents, out_tangents: (K,) per second, for CUBIC; None without any.
    in_weights, out_weights: (K,) handle lengths as fractions of their segment, 0 … 1; None means a third.
    """

    time_axis: TimeAxis
    values: Floats
    modes: NDArray[np.uint8]
    in_tangents: Floats | None = None
    out_tangents: Floats | None = None
    in_weights: Floats | None = None
    out_weights: Floats | None = None

    def __post_init__(self) -> None:
        shape = str(len(self.time_axis))
        object.__setattr__(self, "values", arrays.as_floats(self.values, shape, name="values"))
        arrays.check_shape(self.modes, shape, name="modes")
        for name in HANDLES:
            given = getattr(self, name)
            if given is not None:
                object.__setattr__(self, name, arrays.as_floats(given, shape, name=name))
                if name in WEIGHTS and not ((given >= 0) & (given <= 1)).all():
                    raise RangeError(f"{name} go from {given.min():g} to {given.max():g} (expected shares, 0 … 1)")
        if (self.in_tangents is None or self.out_tangents is None) and CUBIC in self.modes.tobytes():
            raise ShapeError("a cubic curve lacks tangents")

    @property
    def keys(self) -> Keys:
        """All keys, as plain arrays."""
        handles = self.in_tangents, self.out_tangents, self.in_weights, self.out_weights
        return Keys(self.times, self.values, self.modes, *handles)

    @property
    def times(self) -> Floats:
        """Key times (K,) in seconds."""
        return self.time_axis.times

    @property
    def is_constant(self) -> bool:
        """True if all values are equal."""
        if len(self.values) == 1:
            return True
        flat = (
            self.in_tangents is None
            or self.out_tangents is None
            or not (self.in_tangents[1:].any() or self.out_tangents[:-1].any())
        )
        return flat and bool((self.values == self.values[0]).all())

    def scaled(self, factor: float) -> Curve:
        """Return the curve with values and tangents multiplied."""
        arriving = None if self.in_tangents is None else self.in_tangents * factor
        leaving = None if self.out_tangents is None else self.out_tangents * factor
        return replace(self, values=self.values * factor, in_tangents=arriving, out_tangents=leaving)

    def select_keys(self, keys: Ints, times: TimeAxis) -> Curve:
        """Return the curve with these keys (K,) only, at the K new times."""
        parts = {name: getattr(self, name) for name in HANDLES}
        handles = {name: None if part is None else part[keys] for name, part in parts.items()}
        return Curve(times, self.values[keys], self.modes[keys], **handles)


def constant(value: float) -> Curve:
    """Return a constant curve: a single key at 0 s."""
    return linear(np.zeros(1), np.array([value]))


def linear(times: TimeAxis | Floats, values: Floats) -> Curve:
    """Return a linear curve through keys (K,)."""
    return Curve(as_time_axis(times), values, uniform_modes(len(times), Mode.LINEAR))


def uniform_modes(count: int, mode: Mode) -> NDArray[np.uint8]:
    """Return the same mode for every key."""
    return np.full(count, mode, np.uint8)


def evaluate(curve: Curve, at: Floats, *, before: bool = False) -> Floats:
    """Return the value at times `at` (any shape) in seconds; at a jump, the value after it.

    before: the value before the jump instead.
    (0 s: 1, 2 s: 3, linear) at 0.5 → 1.5
    """
    place: Ints = np.searchsorted(curve.times, at, side="left" if before else "right")
    left = np.clip(place - 1, 0, len(curve.times) - 1)
    if len(curve.times) == 1:
        return curve.values[left]
    return interpolate(curve.keys, left, np.minimum(left + 1, len(curve.times) - 1), at)


def interpolate(keys: Keys, left: Ints, right: Ints, at: Floats) -> Floats:
    """Return the values at times `at` (any shape) between keys `left` and the next ones `right`, of that shape.

    Values before `left`, and those of a last key, where right = left, are the key's own.
    """
    duration = keys.times[right] - keys.times[left]
    inside = (at > keys.times[left]) & (duration > 0) & (keys.modes[left] != Mode.STEP)
    u = np.where(inside, (at - keys.times[left]) / np.where(duration > 0, duration, 1.0), 0.0)
    start, end = keys.values[left], keys.values[right]
    values: Floats = np.where(u == 1, end, start + u * (end - start))
    cubic: Any = inside & (keys.modes[left] == Mode.CUBIC)
    if cubic.any():
        assert keys.in_tangents is not None
        assert keys.out_tangents is not None
        leaving, arriving = duration * keys.out_tangents[left], duration * keys.in_tangents[right]
        if keys.in_weights is None and keys.out_weights is None:
            values = np.where(cubic, hermite.evaluate(u, start, leaving, end, arriving), values)
        else:
            first, second = keys.weights(left, right)
            s = bezier.parameter(u, first, 1 - second)
            points = (start, start + first * leaving, end - second * arriving, end)
            values = np.where(cubic, _bezier(s, *points), values)
    return values


def _bezier(s: Floats, p0: Floats, p1: Floats, p2: Floats, p3: Floats) -> Floats:
    r = 1 - s
    return r**3 * p0 + 3 * s * r * r * p1 + 3 * s * s * r * p2 + s**3 * p3


def travel(curve: Curve, a: Floats, b: Floats) -> Floats:
    """Return a bound (B,) of the value's total variation from times a to b (B,).

    a, b: between the same two keys, or outside all. The bound of a cubic is that of its whole segment.
    """
    straight = np.abs(evaluate(curve, b, before=True) - evaluate(curve, a))
    if not (curve.modes == Mode.CUBIC).any():
        return straight
    left = np.clip(np.searchsorted(curve.times, a, side="right") - 1, 0, len(curve.times) - 1)
    right = np.minimum(left + 1, len(curve.times) - 1)
    inside = (curve.modes[left] == Mode.CUBIC) & (a >= curve.times[0])
    return np.where(inside, control_length(curve.keys, left, right), straight)


def control_length(keys: Keys, left: Ints, right: Ints) -> Floats:
    """Return the lengths (...) of the Bézier polygons of cubics from keys `left` to `right` (...)."""
    assert keys.in_tangents is not None
    assert keys.out_tangents is not None
    duration, (leaving, arriving) = keys.times[right] - keys.times[left], keys.weights(left, right)
    points = (
        keys.values[left],
        keys.values[left] + leaving * duration * keys.out_tangents[left],
        keys.values[right] - arriving * duration * keys.in_tangents[right],
        keys.values[right],
    )
    return np.asarray(sum(np.abs(q - p) for p, q in pairwise(points)))
