"""Bounds of one version's quaternions within intervals.

A quaternion q, the mix c unchanged or normalized, satisfies q″ = −λq − 2ρq′ + e. On an arc λ = ν², on a line 0,
with ρ = e = 0. Normalized, λ = |q′|², ρ = c·c′/|c|², and e is the part of c″/|c| perpendicular to q; on a
line |c|²|q′| is constant, and ρ′ = λ − ρ².
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats

MIN_MIX_LENGTH = 1e-3  # length of a mix; shorter ones have no reliable direction


class QuaternionBounds(NamedTuple):
    """Quaternions of P players in L pairs of a node and an interval; every value (P, L) unless noted.

    value, slope: (2, 4, P, L), q and q′ at both ends. size, speed: bounds of |q| and |q′|. lambda_: (2, P, L), λ at
    both ends; max_lambda, lambda_rate: bounds of λ and |λ′|. rho, max_rho, rho_rate: the same of ρ. own: (2, 4, P, L),
    max_residual, residual_rate: the same of e; None and 0 without e. excess: (3, P, L), bounds of |1 − |q|²| and its
    first two derivatives.
    """

    value: Floats
    slope: Floats
    size: Floats
    speed: Floats
    lambda_: Floats
    max_lambda: Floats
    lambda_rate: Floats
    rho: Floats
    max_rho: Floats
    rho_rate: Floats
    excess: Floats
    own: Floats | None = None
    max_residual: Floats | float = 0.0
    residual_rate: Floats | float = 0.0

    @property
    def bend(self) -> Floats:
        """Bound of |q″| (P, L)."""
        return np.asarray(self.max_lambda * self.size + 2 * self.max_rho * self.speed + self.max_residual)


class ArcMix(NamedTuple):
    """Mixes c that are known at both ends of intervals. value, slope: (2, 4, P, L), c and c′.

    square, along, rate: (2, P, L), |c|², c·c′, |c′|².
    """

    value: Floats
    slope: Floats
    square: Floats
    along: Floats
    rate: Floats

    def part(self, players: slice) -> ArcMix:
        """Return the same of some players."""
        return ArcMix(*(each[..., players, :] for each in self))


class ChordBounds(NamedTuple):
    """A mix on a line, scaled to length 1 at an interval's start; (P, L), or (2, P, L) at both ends.

    square: |c|², along: c·c′, rate: |c′|². wedge: (|c|²|q′|)², which is constant. nearest, farthest: the smallest and
    the largest |c|².
    """

    square: Floats
    along: Floats
    rate: Floats
    wedge: Floats
    nearest: Floats
    farthest: Floats

    def part(self, players: slice) -> ChordBounds:
        """Return the same of some players."""
        return ChordBounds(*(each[..., players, :] for each in self))


def arc_mix(value: Floats, slope: Floats) -> ArcMix:
    """Return a mix by its values and slopes (2, 4, P, L)."""
    return ArcMix(value, slope, *((x * y).sum(axis=1) for x, y in ((value, value), (value, slope), (slope, slope))))


def chord_bounds(of: ArcMix, h: Floats) -> ChordBounds:
    """Return a mix on a line, or the chord of another one. h: (L,) s."""
    first, along, rate = of.square[0], of.along[0], of.rate[0]
    least = nearest(first, along, rate, h)
    wedge = np.maximum(first * rate - along**2, 0.0)
    most = of.square.max(axis=0)
    return ChordBounds(of.square / first, of.along / first, rate / first, wedge / first**2, least / first, most / first)


def slerp_bounds(of: ArcMix, turn: Floats, h: Floats) -> QuaternionBounds:
    """Return the bounds of arcs and lines without normalization: q = c.

    turn: (P, L) rad, ν times the interval's length.
    """
    reach = 1 - turn * turn / 8  # |c| is at most the larger end divided by this, and so is |c′|, since c″ = −ν²c
    size, speed = (np.sqrt(each.max(axis=0)) / reach for each in (of.square, of.rate))
    pull = (turn / h) ** 2
    none = [np.zeros_like(turn) for _ in range(3)]
    excess = _excess(of, pull, h)
    both = np.stack((pull, pull))
    return QuaternionBounds(
        of.value.copy(), of.slope, size, speed, both, pull, none[0], 0 * both, none[1], none[2], excess
    )


def nlerp_bounds(of: ArcMix, chord: ChordBounds) -> QuaternionBounds:
    """Return the bounds of normalized lines: q = c / |c|. chord: that of `chord_bounds`."""
    drag = chord.along / chord.square
    most_drag = np.abs(chord.along).max(axis=0) / chord.nearest
    pull, most_pull = chord.wedge / chord.square**2, chord.wedge / chord.nearest**2
    rates = 4 * most_drag * most_pull, np.maximum(most_pull, most_drag**2)
    value, slope = directed(of, drag)
    size, none = np.ones_like(most_pull), np.zeros((3, *most_pull.shape))
    return QuaternionBounds(
        value, slope, size, np.sqrt(most_pull), pull, most_pull, rates[0], drag, most_drag, rates[1], none
    )


def select_bounds(into: QuaternionBounds, part: QuaternionBounds, players: slice, where: Bools) -> None:
    """Write the bounds of some players into those of all. where: (P', L), mask of the part's."""
    for name in QuaternionBounds._fields[:11]:
        np.copyto(getattr(into, name)[..., players, :], getattr(part, name), where=where)


def nearest(square: Floats, along: Floats, rate: Floats, h: Floats) -> Floats:
    """Return the smallest |c|² on a line, nan near 0, from |c|² and c·c′ at its start, and |c′|²."""
    until = np.clip(-along / np.where(rate > 0, rate, 1.0), 0.0, h)
    least = square + until * (2 * along + until * rate)
    return np.asarray(np.where(least > MIN_MIX_LENGTH**2, least, np.nan))


def directed(of: ArcMix, drag: Floats) -> tuple[Floats, Floats]:
    """Return the direction of a mix, and its derivative (2, 4, P, L). drag: (2, P, L)."""
    over = 1 / np.sqrt(of.square)[:, None]
    value = of.value * over
    return value, of.slope * over - drag[:, None] * value


def _excess(of: ArcMix, pull: Floats, h: Floats) -> Floats:
    """Bound of |c|² − 1, with two derivatives: it oscillates about its mean with 2ν, or is constant."""
    push = 2 * (of.rate[0] - pull * of.square[0])
    drift = 2 * of.along[0]
    swing = np.sqrt(push * push + 4 * pull * drift * drift)
    change = 2 * np.abs(of.along).max(axis=0) + h / 2 * swing
    return np.stack((np.abs(1 - of.square).max(axis=0) + h * h / 8 * swing, change, swing))
