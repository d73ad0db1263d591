"""Majorants of rotation matrices, in several players, in two versions of a clip."""

from __future__ import annotations

import numpy as np

from anim.arrays import Bools, Floats
from anim.maths import quaternion
from anim.measure.continuous_bound.cubic_bounds import with_cubics
from anim.measure.continuous_bound.derivative_bounds import derivative_bound, product
from anim.measure.continuous_bound.difference_bounds import difference_bounds
from anim.measure.continuous_bound.quaternion_bounds import (
    ChordBounds,
    QuaternionBounds,
    arc_mix,
    chord_bounds,
    nlerp_bounds,
    select_bounds,
    slerp_bounds,
)
from anim.measure.continuous_bound.rotation_endpoints import RotationEndpoints


def rotation_bounds(first: RotationEndpoints, second: RotationEndpoints, h: Floats) -> tuple[Floats, Floats]:
    """Return the majorant (3, 2, L) of matrices from quaternions, and bounds of their jumps (L,).

    Valid for each of the players. A matrix is q·x·q* + (1 − |q|²)·x of a vector x, for any quaternion q: a product
    of q with itself, and a remainder if q is not of unit length. If the quaternion is normalized in an interval but not
    after it, or the other way round, matrices jump at its end, both versions together by at most the second result.
    h: (L,) s, lengths of intervals.
    """
    second = _on_the_side_of(first, second)
    (a, line_a), (b, line_b) = _arc_bounds(first, h), _arc_bounds(second, h)
    lines = first.unit & second.unit & ~(first.is_cubic | second.is_cubic)
    other = ~_same(first, second)
    apart = np.where(other, difference_bounds(a, b, (line_a, line_b, lines), h), 0.0)
    # the maximum over players, each by itself: maxima of the sums would be too close to each other
    q = derivative_bound(np.stack((a.size, a.speed, a.bend)).max(axis=1), apart.max(axis=1))
    uneven = derivative_bound(a.excess.max(axis=1), np.where(other, a.excess + b.excess, 0.0).max(axis=1))
    return product(q, q) + uneven, np.asarray((_jumps(first) + _jumps(second)).max(axis=0))


def _on_the_side_of(first: RotationEndpoints, second: RotationEndpoints) -> RotationEndpoints:
    """The second version with signs like the first's: q and −q are one rotation."""
    sign = np.where((first.value[0] * second.value[0]).sum(axis=0) < 0, -1.0, 1.0)
    cubic = None if second.cubic is None else second.cubic * sign
    return second._replace(value=second.value * sign, cubic=cubic)


def _same(first: RotationEndpoints, second: RotationEndpoints) -> Bools:
    """Mask (P, L) of equal motion in both versions."""
    same: Bools = (first.value == second.value).all(axis=(0, 1)) & (first.turn == second.turn)
    same &= first.unit == second.unit
    if first.cubic is None and second.cubic is None:
        return same
    if first.cubic is None or second.cubic is None:
        return same & ~(first.is_cubic | second.is_cubic)
    return np.asarray(same & (first.cubic == second.cubic).all(axis=(0, 1, 2)) & (first.is_cubic == second.is_cubic))


def _arc_bounds(of: RotationEndpoints, h: Floats) -> tuple[QuaternionBounds, ChordBounds]:
    """Bounds of quaternions, and their mixes as lines. h: (L,) s."""
    start, end = of.value
    turn = np.maximum(of.turn, quaternion.MIN_ANGLE)
    sine, cosine = turn / (h * np.sin(turn)), np.cos(of.turn)
    mixed = arc_mix(of.value, np.stack(((end - cosine * start) * sine, (cosine * end - start) * sine)))
    found, chord = slerp_bounds(mixed, of.turn, h), chord_bounds(mixed, h)
    players = np.flatnonzero((of.unit & ~of.is_cubic).any(axis=1))
    if len(players):
        some = slice(int(players[0]), int(players[-1]) + 1)
        select_bounds(found, nlerp_bounds(mixed.part(some), chord.part(some)), some, of.unit[some])
    return found if of.cubic is None else with_cubics(found, of.value, of.cubic, of.is_cubic, h), chord


def _jumps(of: RotationEndpoints) -> Floats:
    square = (of.value[1] * of.value[1]).sum(axis=0)
    return np.where(of.unit != of.next_unit, 2 * np.abs(square - 1), 0.0)
