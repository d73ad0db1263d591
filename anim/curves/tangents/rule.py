"""Types of tangent rules, and periodic extension of keys."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from anim.arrays import Floats


@dataclass(frozen=True, slots=True)
class SplineKeys:
    """Keys of a CUBICSPLINE track: values (K, C), tangents (K, C) per second.

    departure: greatest distance of a value from its original key (radians for rotations); 0 unless the rule
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
    """Rule for the tangents of keys, for open tracks and for loops.

    cyclic: the same function as `open` if the rule doesn't distinguish them.
    smooth: whether the result is C2. Such rules treat rotations by component, since C2 components stay C2 when the
    player normalizes the quaternion. The others treat rotations by angular velocity.
    loop: whether it treats every track as a loop.
    by_path: whether slopes of a component depend on the others, as by distances between keys, or scipy's threshold.
    """

    name: str
    open: Rule
    cyclic: Rule
    smooth: bool = False
    loop: bool = False
    by_path: bool = False


def local_rule(name: str, slopes: Slopes, *, by_path: bool = False) -> TangentRule:
    """Return a rule of at most two neighbors on each side; in a loop those of the other end."""

    def open_keys(times: Floats, values: Floats) -> SplineKeys:
        return SplineKeys(values, *slopes(times, values))

    def cyclic_keys(times: Floats, values: Floats) -> SplineKeys:
        before, after = slopes(*extend_loop(times, values, 2))
        return SplineKeys(values, before[2:-2], after[2:-2])

    return TangentRule(name, open_keys, cyclic_keys, by_path=by_path)


def extend_loop(times: Floats, values: Floats, count: int) -> tuple[Floats, Floats]:
    """Return times (K + 2·count,) and values (K + 2·count, C) with `count` keys of the loop on each side.

    The last key is the first one of the next cycle; the difference of their values is the displacement per cycle.
    extend_loop([0, 1, 3], [[0], [5], [0]], 1) → [−2, 0, 1, 3, 4], [[5], [0], [5], [0], [5]]
    """
    laps, at = np.divmod(np.arange(-count, len(times) + count), len(times) - 1)
    return (
        times[at] + laps * (times[-1] - times[0]),
        values[at] + laps[:, None] * (values[-1] - values[0]),
    )
