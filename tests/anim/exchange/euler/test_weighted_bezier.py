"""Cubics with handles of any length, against the Bézier curve drawn by its parameter."""

from __future__ import annotations

import numpy as np
import pytest

from anim.exchange.euler.curve import Curve, Mode, evaluate, travel, uniform_modes
from anim.exchange.euler.from_euler import from_euler
from anim.exchange.euler.motion import EulerMotion, EulerNode
from anim.maths.bezier import parameter
from anim.maths.euler import AxesConvention
from anim.model import TimeAxis
from anim.sampling.track import sample

HANDLES = [(1 / 3, 1 / 3), (0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.9, 0.7), (0.02, 0.98), (0.5, 0.25)]


def _curve(leaving: float, arriving: float) -> Curve:
    """From 1 at 2 s with slope 3 to −2 at 6 s with slope −1."""
    return Curve(
        TimeAxis((2.0, 6.0)), np.array((1.0, -2.0)), uniform_modes(2, Mode.CUBIC),
        np.array((0.0, -1.0)), np.array((3.0, 0.0)), np.array((0.3, arriving)), np.array((leaving, 0.3)),
    )  # fmt: skip


@pytest.mark.parametrize(("leaving", "arriving"), HANDLES)
def test_it_is_the_bezier_curve_through_its_handles(leaving: float, arriving: float) -> None:
    """De Casteljau in the plane of time and value."""
    before, after = (2 + 4 * leaving, 1 + 12 * leaving), (6 - 4 * arriving, -2 + 4 * arriving)
    corners = np.array(((2.0, 1.0), before, after, (6.0, -2.0)))
    for u in np.linspace(0, 1, 101):
        points = corners
        while len(points) > 1:
            points = points[:-1] + u * np.diff(points, axis=0)
        assert evaluate(_curve(leaving, arriving), points[0, :1])[0] == pytest.approx(points[0, 1], abs=1e-7)


def test_a_third_is_the_plain_cubic() -> None:
    at = np.linspace(2, 6, 1001)
    weighted = _curve(1 / 3, 1 / 3)
    plain = Curve(weighted.time_axis, weighted.values, weighted.modes, weighted.in_tangents, weighted.out_tangents)
    np.testing.assert_allclose(evaluate(weighted, at), evaluate(plain, at), atol=1e-12)


@pytest.mark.parametrize(("leaving", "arriving"), HANDLES)
def test_time_never_runs_back(leaving: float, arriving: float) -> None:
    share = np.linspace(0, 1, 5001)
    u = parameter(share, leaving, 1 - arriving)
    assert (np.diff(u) >= 0).all()
    assert (u[0], u[-1]) == (0, 1)
    v = 1 - u
    np.testing.assert_allclose(3 * leaving * u * v**2 + 3 * (1 - arriving) * u**2 * v + u**3, share, atol=1e-12)


@pytest.mark.parametrize(("leaving", "arriving"), HANDLES)
def test_travel_bounds_it(leaving: float, arriving: float) -> None:
    curve = _curve(leaving, arriving)
    runs = np.abs(np.diff(evaluate(curve, np.linspace(2, 6, 4001)))).sum()
    assert runs <= travel(curve, np.array((2.0,)), np.array((6.0,)))[0] + 1e-9


def test_the_written_track_follows_it() -> None:
    curve = _curve(0.9, 0.7)
    node = EulerNode("a", -1, np.zeros(3), "XYZ", AxesConvention.INTRINSIC, np.zeros(3), (curve, None, None))
    track = from_euler(EulerMotion((node,)), tolerance=1e-3).clip.tracks[0]
    at = np.linspace(2, 6, 5001)
    turned = 2 * np.arctan2(sample(track, at)[:, 0], sample(track, at)[:, 3])
    off = (turned - evaluate(curve, at) + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(off).max() < 1e-3
