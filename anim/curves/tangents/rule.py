"""The types of tangent rules: what they return, what they are, and how a loop goes on beyond its ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from anim.arrays import Floats


@dataclass(frozen=True, slots=True)
class SplineKeys:
    """Keys of a CUBICSPLINE track: values (K, C), tangents (K, C) per second.

    departure: the greatest distance of a value from the key it was made of (radians for rotations); 0 unless the rule
    approximates.
    """

    values: Floats
    in_tangents: Floats
    out_tangents: Floats
    departure: float = 0.0


Rule: TypeAlias = Callable[[Floats, Floats], SplineKeys]  # times (K,), values (K, C), K ≥ 2
Slopes: TypeAlias = Callable[[Floats, Floats], tuple[Floats, Floats]]  # the same → slopes (K, C) before and after keys


@dataclass(frozen=True, slots=True)
class TangentRule:
    """One way to find the tangents of keys that have none, for a track with ends and for a loop.

    cyclic: the same function as `open` if the rule makes no difference.
    smooth: whether the result is C2: such rules treat rotations by component, since a quaternion whose components are
    C2 stays so when the player normalizes it. The others treat rotations by their rates.
    loop: whether it takes every track for a loop.
    """

    name: str
    open: Rule
    cyclic: Rule
    smooth: bool = False
    loop: bool = False


def local_rule(name: str, slopes: Slopes) -> TangentRule:
    """Return a rule that sees at most two neighbors on each side; a loop lends it those from its other end."""

    def open_keys(times: Floats, values: Floats) -> SplineKeys:
        return SplineKeys(values, *slopes(times, values))

    def cyclic_keys(times: Floats, values: Floats) -> SplineKeys:
        before, after = slopes(*extended(times, values, 2))
        return SplineKeys(values, before[2:-2], after[2:-2])

    return TangentRule(name, open_keys, cyclic_keys)


def extended(times: Floats, values: Floats, count: int) -> tuple[Floats, Floats]:
    """Return times (K + 2·count,) and values (K + 2·count, C) with `count` more keys of the loop before and after.

    The last key is the first one of the next lap; what its value differs by is the way made in a lap, and goes on.
    extended([0, 1, 3], [[0], [5], [0]], 1) → [−2, 0, 1, 3, 4], [[5], [0], [5], [0], [5]]
    """
    laps, at = np.divmod(np.arange(-count, len(times) + count), len(times) - 1)
    return (
        times[at] + laps * (times[-1] - times[0]),
        values[at] + laps[:, None] * (values[-1] - values[0]),
    )
