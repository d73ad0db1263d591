"""Fits: within the tolerance at 1000 samples a piece, and with no more pieces than TABLE lists."""

from __future__ import annotations

from dataclasses import fields
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from anim.arrays import Floats
from anim.curves.easing.function import evaluate
from anim.curves.easing.table import EASINGS, parse
from anim.curves.fitting.easing_fit import fit_cubic, fit_linear, fit_segments
from anim.errors import RangeError
from anim.maths import hermite
from anim.maths import quaternion as quat
from anim.model import Track
from anim.operations.cubic_segments import CubicSegments
from anim.operations.ease_track import ease_segments

MANY = np.linspace(0, 1, 1001)
CURVED = [name for name, ease in EASINGS.items() if ease.exact is None]
TABLE = {  # ease: cubic and linear pieces at 1e-3
    "smoothstep": (1, 27),
    "sine-in-out": (4, 25),
    "smootherstep": (6, 27),
    "quart-in": (3, 39),
    "expo-out": (8, 76),
    "ease": (8, 39),
    "ease-in-out": (5, 24),
    "elastic-out": (25, 216),
}


@pytest.mark.parametrize("name", TABLE)
def test_needs_no_more_pieces_than_the_note(name: str) -> None:
    ease = EASINGS[name]
    cubic, linear = TABLE[name]
    assert len(fit_segments(ease, tolerance=1e-3)) <= cubic
    assert len(fit_linear(ease.value, ease.breakpoints, 1e-3)) - 1 <= linear


@pytest.mark.parametrize("name", [*CURVED, "spring(100, 5)", "spring(100, 80)", "cubic-bezier(0, 1, 1, 0)"])
def test_cubics_stay_within_the_tolerance(name: str) -> None:
    ease = parse(name)
    pieces = fit_segments(ease, tolerance=1e-3)
    u = np.concatenate([p.start + (p.end - p.start) * MANY for p in pieces])
    worst = np.abs(evaluate(pieces, u) - ease.value(u)).max()
    assert worst <= 1e-3
    assert [p.start for p in pieces[1:]] == [p.end for p in pieces[:-1]]
    assert set(ease.breakpoints) <= {p.end for p in pieces}


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6])
def test_tolerance_is_kept_whatever_it_is(tolerance: float) -> None:
    for name in ("smootherstep", "expo-in", "quint-in-out"):
        ease = EASINGS[name]
        pieces = fit_segments(ease, tolerance=tolerance)
        assert np.abs(evaluate(pieces, MANY) - ease.value(MANY)).max() <= tolerance


def test_smooth_eases_stay_c1() -> None:
    for name in ("smootherstep", "sine-in-out", "ease", "elastic-out"):
        pieces = fit_segments(EASINGS[name], tolerance=1e-3)
        slopes = [(a.slope1, b.slope0) for a, b in pairwise(pieces)]
        assert all(before == after for before, after in slopes)


def test_fit_of_a_known_cubic_is_one_piece() -> None:
    (piece,) = fit_cubic(lambda u: u * u * u, lambda u: 3 * u * u, (), 1e-7)
    assert (piece.slope0, piece.slope1) == (0, 3)


def test_fewer_pieces_are_not_enough() -> None:
    """The longest first piece, found here by plain scanning, is no shorter than ours, and not half the way."""
    ease = EASINGS["smootherstep"]

    def worst(end: float) -> float:
        u = end * MANY
        slopes = end * ease.derivative(np.array([0.0, end]))
        fitted = hermite.evaluate(MANY, np.zeros(1), slopes[0], ease.value(np.array([end])), slopes[1])
        return float(np.abs(fitted - ease.value(u)).max())

    pieces = fit_segments(ease, tolerance=1e-3)
    longest = max(end for end in np.linspace(0.01, 1, 300) if worst(end) <= 1e-3)
    assert pieces[0].end <= longest + 1e-9
    assert longest + longest < 1  # by symmetry two pieces can't do


@pytest.mark.parametrize("name", ["quad-in", "circ-out", "bounce-out", "elastic-in-out", "ease"])
def test_chords_stay_within_the_tolerance(name: str) -> None:
    ease = EASINGS[name]
    u = fit_linear(ease.value, ease.breakpoints, 1e-3)
    dense = np.concatenate([a + (b - a) * MANY for a, b in pairwise(u)])
    assert np.abs(np.interp(dense, u, ease.value(u)) - ease.value(dense)).max() <= 1e-3


def test_parabola_has_evenly_spaced_chords() -> None:
    """h²/8 · 2 = 1e-3 gives h = 0.0632, so 16 chords."""
    u = fit_linear(lambda x: x * x, (), 1e-3)
    assert len(u) == 17
    np.testing.assert_allclose(np.diff(u), 1 / 16, rtol=0.05)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, 1e-8, np.inf, np.nan])
def test_tolerance_out_of_range(tolerance: float) -> None:
    with pytest.raises(RangeError, match="tolerance is"):
        fit_segments(EASINGS["sine-in"], tolerance=tolerance)


# Rotations

START = np.asarray(Rotation.from_euler("xyz", [20, -50, 130], degrees=True).as_quat())
AXIS = np.array([2.0, -1.0, 2.0]) / 3


def turned(degrees: float) -> Floats:
    """Return START turned about its own AXIS, with the other sign."""
    return np.asarray(-(Rotation.from_quat(START) * Rotation.from_rotvec(np.radians(degrees) * AXIS)).as_quat())


def turn(degrees: float, name: str, tolerance: float) -> CubicSegments:
    """Return the eased segments from START to `turned(degrees)`, within a second."""
    track = Track(0, "rotation", "LINEAR", [0, 1], np.stack((START, turned(degrees))))
    return ease_segments(track, np.ones(1, bool), EASINGS[name], 1e-3, tolerance)


def worst_angle(found: CubicSegments, name: str, degrees: float) -> float:
    """Return the greatest angle in radians between what a player shows and the eased turn made with scipy."""
    worst = 0.0
    for a, b, v0, v1, m0, m1 in zip(*(getattr(found, each.name) for each in fields(found)), strict=True):
        shown = Rotation.from_quat(hermite.evaluate(MANY[:, None], v0, (b - a) * m0, v1, (b - a) * m1))
        angle = np.radians(degrees) * EASINGS[name].value(a + (b - a) * MANY)
        true = Rotation.from_quat(START) * Rotation.from_rotvec(angle[:, None] * AXIS)
        worst = max(worst, float((shown.inv() * true).magnitude().max()))
    return worst


@pytest.mark.parametrize("degrees", [1.0, 45.0, 90.0, 179.0])
@pytest.mark.parametrize("name", ["linear", "smoothstep", "ease", "back-out", "bounce-out", "elastic-out", "circ-in"])
def test_turns_stay_within_the_tolerance(name: str, degrees: float) -> None:
    tolerance = np.radians(0.1)
    found = turn(degrees, name, tolerance)
    assert worst_angle(found, name, degrees) <= tolerance + 1e-9
    for ends in (found.value0, found.value1):
        np.testing.assert_allclose(np.linalg.norm(ends, axis=1), 1, atol=1e-15)
    assert (quat.dot(found.value0, found.value1) > 0).all()
    steps = quat.angle_between(found.value0, found.value1)
    assert np.degrees(steps.max()) <= 120 + 1e-6


@pytest.mark.parametrize(("degrees", "tolerance", "pieces"), [(90, 0.1, 3), (90, 0.01, 4), (179, 0.1, 4)])
def test_smoothstep_turn_needs_few_pieces(degrees: float, tolerance: float, pieces: int) -> None:
    assert len(turn(degrees, "smoothstep", np.radians(tolerance)).start) <= pieces


def test_turn_starts_and_ends_at_the_keys() -> None:
    found = turn(70, "sine-in-out", 1e-3)
    np.testing.assert_allclose(found.value0[0], START, atol=1e-15)
    np.testing.assert_allclose(found.value1[-1], -turned(70), atol=1e-15)


@pytest.mark.parametrize("name", ["linear", "ease", "circ-out", "bounce-in"])
def test_no_turn(name: str) -> None:
    found = turn(0, name, 1e-3)
    np.testing.assert_allclose(found.value0, np.tile(START, (len(found.start), 1)), atol=1e-15)
    np.testing.assert_allclose(found.slope0, 0, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["quint-out", "expo-out", "sine-in-out", "smootherstep"])
@pytest.mark.parametrize("tolerance", [0.05, 0.2])
def test_every_angle_of_a_shared_fit_is_within_the_tolerance(name: str, tolerance: float) -> None:
    """The error at the largest angle was taken as the bound: smaller angles were off by up to 60 % more."""
    limit = np.radians(tolerance)
    for degrees in np.linspace(3, 177, 88):
        assert worst_angle(turn(degrees, name, limit), name, degrees) <= limit, degrees
