"""Springs against their differential equation, and by the closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from anim.curves.easing.spring import settle_time, spring


@pytest.mark.parametrize(("stiffness", "damping"), [(100, 3), (100, 10), (40, 2 * 40**0.5), (100, 21), (9, 300)])
def test_spring_solves_its_equation(stiffness: float, damping: float) -> None:
    end = settle_time(stiffness, damping)
    u = np.linspace(0, 1, 50)
    path = solve_ivp(
        lambda _, y: [y[1], stiffness * (1 - y[0]) - damping * y[1]],
        (0, end),
        [0.0, 0.0],
        t_eval=u * end,
        method="LSODA",
        rtol=1e-9,
        atol=1e-11,
    )
    assert abs(path.y[0, -1] - 1) < 1.001e-3
    np.testing.assert_allclose(spring(stiffness, damping).value(u), path.y[0] / path.y[0, -1], atol=1e-6)


def test_spring_swings_past_by_the_closed_form() -> None:
    ratio = 0.3
    peak = 1 + math.exp(-math.pi * ratio / math.sqrt(1 - ratio**2))
    assert spring(25, 2 * ratio * 5).extent[1] == pytest.approx(peak, rel=1.1e-3)
    assert not spring(25, 10).overshoots


def test_settle_time_does_not_jump_with_the_damping() -> None:
    times = np.array([settle_time(100, d) for d in np.linspace(19.6, 20.4, 81)])
    assert np.abs(np.diff(times)).max() < 0.01
    assert settle_time(100, 20) == pytest.approx(0.9233, abs=1e-4)
