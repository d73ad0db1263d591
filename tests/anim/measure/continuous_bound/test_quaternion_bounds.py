"""Figures of quaternions within one gap, and how far two drift apart, against a fine grid of the very curves."""

from __future__ import annotations

import numpy as np
import pytest

from anim.arrays import Floats
from anim.measure.continuous_bound.cubic_bounds import on_cubics
from anim.measure.continuous_bound.difference_bounds import difference_bounds
from anim.measure.continuous_bound.quaternion_bounds import (
    ChordBounds,
    QuaternionBounds,
    arc_mix,
    chord_bounds,
    nlerp_bounds,
    slerp_bounds,
)

H = np.array([[0.5]])  # s, one gap and one node
U = np.linspace(0, 1, 4001)
WIDTHS = (0.02, 0.3, 0.9)  # rad, between the quaternions at both ends


def _ends(seed: int, width: float) -> tuple[Floats, Floats]:
    """Two quaternions (4,), up to 1 % longer than 1, `width` rad apart."""
    random = np.random.default_rng(seed)
    a, b = (each / np.linalg.norm(each) for each in random.normal(size=(2, 4)))
    b -= a * (a @ b)
    b = np.cos(width) * a + np.sin(width) * b / np.linalg.norm(b)
    return a * random.uniform(1, 1.01), b * random.uniform(1, 1.01)


def _wide(*values: Floats) -> Floats:
    """Vectors (4,) at both ends as (2, 4, 1, 1, 1)."""
    return np.stack(values)[:, :, None, None, None]


def _arc(a: Floats, b: Floats, turn: float) -> tuple[Floats, QuaternionBounds, ChordBounds]:
    curve = (np.sin((1 - U) * turn)[:, None] * a + np.sin(U * turn)[:, None] * b) / np.sin(turn)
    rates = [(b - np.cos(turn) * a), (np.cos(turn) * b - a)]
    of = arc_mix(_wide(a, b), _wide(*rates) * turn / np.sin(turn) / H)
    return curve, slerp_bounds(of, np.full((1, 1, 1), turn), H), chord_bounds(of, H)


def _line(a: Floats, b: Floats) -> tuple[Floats, QuaternionBounds, ChordBounds]:
    curve = a + U[:, None] * (b - a)
    of = arc_mix(_wide(a, b), _wide(b - a, b - a) / H)
    return (
        curve / np.linalg.norm(curve, axis=1, keepdims=True),
        nlerp_bounds(of, chord_bounds(of, H)),
        chord_bounds(of, H),
    )


def _cubic(a: Floats, b: Floats, seed: int, size: float) -> tuple[Floats, QuaternionBounds, ChordBounds]:
    """c = a + u(b − a) + u(1 − u)(p + uq)."""
    p, q = size * np.random.default_rng(seed).normal(size=(2, 4))
    u = U[:, None]
    curve = a + u * (b - a) + u * (1 - u) * (p + u * q)
    slopes, bends = (b - a + p, b - a - p - q), (2 * (q - p), -2 * p - 4 * q)
    value = _wide(a, b)
    found = on_cubics(value, _wide(*slopes) / H, _wide(*bends) / H**2, H)
    return (
        curve / np.linalg.norm(curve, axis=1, keepdims=True),
        found,
        chord_bounds(arc_mix(value, _wide(b - a, b - a) / H), H),
    )


def _jets(curve: Floats) -> list[Floats]:
    """A curve and its first two derivatives per s, without the ends of the grid."""
    t = U * H[0, 0]
    first = np.gradient(curve, t, axis=0)
    return [each[4:-4] for each in (curve, first, np.gradient(first, t, axis=0))]


def _size(vectors: Floats) -> float:
    return float(np.linalg.norm(vectors, axis=1).max())


def _check(curve: Floats, found: QuaternionBounds, *, slack: float) -> None:
    q, rate, bend = _jets(curve)
    assert found.value[0, :, 0, 0, 0] == pytest.approx(curve[0])
    assert found.slope[0, :, 0, 0, 0] == pytest.approx(rate[0], rel=0.05, abs=0.02 * _size(rate))
    for bound, truth in ((found.size, q), (found.speed, rate), (found.bend, bend)):
        assert _size(truth) <= float(bound[0, 0, 0]) * 1.0001 <= slack * _size(truth) + 1e-9
    square = (q * q).sum(axis=1)
    truths = np.abs(1 - square).max(), 2 * np.abs((q * rate).sum(axis=1)).max()
    last = np.abs(2 * (rate * rate).sum(axis=1) + 2 * (q * bend).sum(axis=1)).max()
    for bound, truth in zip(found.excess[:, 0, 0, 0], (*truths, last), strict=True):
        assert truth <= bound * 1.001 + 1e-4 * _size(bend) + 1e-7


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("seed", range(4))
def test_figures_of_arcs_lines_and_cubics(seed: int, width: float) -> None:
    a, b = _ends(seed, width)
    curve, found, _ = _arc(a, b, width)
    _check(curve, found, slack=1.3)
    curve, found, _ = _line(a, b)
    _check(curve, found, slack=2)
    curve, found, _ = _cubic(a, b, seed, 0.3 * width)
    _check(curve, found, slack=np.inf)


@pytest.mark.parametrize("seed", range(4))
def test_a_cubic_that_dips(seed: int) -> None:
    """A tenth as long in the middle: it turns far more quickly there than at both ends."""
    a, b = _ends(seed, 0.9)
    dip = -1.8 * (a + b)
    u = U[:, None]
    curve = a + u * (b - a) + u * (1 - u) * dip
    bend = _wide(-2 * dip, -2 * dip) / H**2
    found = on_cubics(_wide(a, b), _wide(b - a + dip, b - a - dip) / H, bend, H)
    _check(curve / np.linalg.norm(curve, axis=1, keepdims=True), found, slack=np.inf)


def test_an_arc_that_is_longest_between_its_ends() -> None:
    """The same quaternion at both ends, and a turn of 0.9 rad: in the middle it is 1 / cos(0.45) times as long."""
    a, _ = _ends(0, 0.9)
    curve, found, _ = _arc(a, a, 0.9)
    assert _size(curve) > 1.1 * _size(curve[:1])
    _check(curve, found, slack=1.3)


def test_what_of_a_bend_is_sideways_is_bounded_between_ends_that_have_none_of_it() -> None:
    """The bend points along the quaternion at both ends, outwards and inwards, and across it in the middle."""
    a, b = (np.array([0, 0, np.sin(x), np.cos(x)]) for x in (-0.4, 0.4))
    first, last = 3 * a, -3 * b
    slopes = b - a - (2 * first + last) / 6, b - a + (first + 2 * last) / 6
    found = on_cubics(_wide(a, b), _wide(*slopes) / H, _wide(first, last) / H**2, H)
    u = U[:, None]
    bends = first + u * (last - first)
    curve = a + u * slopes[0] + u * u * first / 2 + u**3 * (last - first) / 6
    assert curve[-1] == pytest.approx(b)
    length = np.linalg.norm(curve, axis=1, keepdims=True)
    across = (bends - curve * (curve * bends).sum(axis=1, keepdims=True) / length**2) / length / H**2
    assert found.own is not None
    assert np.abs(found.own).max() < 1e-12
    assert 1 < _size(across) <= float(np.asarray(found.max_residual)[0, 0, 0])


def test_drift_of_lines_that_change_in_length_more_than_they_turn() -> None:
    """One is the other turned in space: |d″| = 2ρ|d′| nearly, as λ is next to nothing."""
    a = np.array([0.0, 0, 0, 1])
    b = 1.4 * np.array([0, 0, np.sin(0.05), np.cos(0.05)])
    cos, sin = np.cos(0.01), np.sin(0.01)
    turn = np.array([[cos, -sin, 0, 0], [sin, cos, 0, 0], [0, 0, cos, -sin], [0, 0, sin, cos]])
    first, second = _line(a, b), _line(turn @ a, turn @ b)
    found = difference_bounds(first[1], second[1], (first[2], second[2], np.full((1, 1, 1), True)), H)[:, 0, 0, 0]
    truths = [_size(y - x) for x, y in zip(_jets(first[0]), _jets(second[0]), strict=True)]
    assert truths[2] <= found[2] <= 6 * truths[2]


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("kinds", ["ll", "la", "al", "aa", "cc", "lc", "ca"])
def test_drift(kinds: str, width: float) -> None:
    """All pairs of laws, of nearly the same turn and of others: no derivative of the difference exceeds its bound."""
    for seed in range(4):
        for off in (0.0, 1e-4, 0.1):
            a, b = _ends(seed, width)
            c, d = a * 1.001 + off * width * np.roll(b, 1), b + off * width * np.roll(a, 2)
            first, second = _curve(kinds[0], a, b, width, seed), _curve(kinds[1], c, d, width * (1 + off), seed)
            lines = np.full((1, 1, 1), kinds == "ll")
            found = difference_bounds(first[1], second[1], (first[2], second[2], lines), H)[:, 0, 0, 0]
            noise = 3e-6 * width / np.array([1, *(H[0, 0] ** k for k in (1, 2))])
            truths = [_size(y - x) for x, y in zip(_jets(first[0]), _jets(second[0]), strict=True)]
            assert (truths <= found * 1.001 + noise).all(), (seed, off, truths, found)


def test_drift_of_two_lines_of_one_turn_is_tight() -> None:
    """The first half of a wide chord beside the first half as a chord of its own: only their speeds differ."""
    a, b = (np.array([0, 0, np.sin(x), np.cos(x)]) for x in (0.0, 0.8))
    whole, half = _line(a, (a + b) / 2), _line(a, (a + b) / np.linalg.norm(a + b))
    found = difference_bounds(whole[1], half[1], (whole[2], half[2], np.full((1, 1, 1), True)), H)[:, 0, 0, 0]
    truths = [_size(y - x) for x, y in zip(_jets(whole[0]), _jets(half[0]), strict=True)]
    assert truths[2] <= found[2] <= 3 * truths[2]


def _curve(kind: str, a: Floats, b: Floats, width: float, seed: int) -> tuple[Floats, QuaternionBounds, ChordBounds]:
    if kind == "a":
        return _arc(a, b, width)
    return _line(a, b) if kind == "l" else _cubic(a, b, seed, 0.2 * width)
