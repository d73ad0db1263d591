"""Advice for steps that are too long."""

from __future__ import annotations

import pytest

from anim.simulation.report import advise_step


@pytest.mark.parametrize(
    ("omega_h", "limit", "integrator", "advice"),
    [
        (1.9, 2.0, "verlet", ""),
        (2.4, 2.0, "verlet", "ω·h = 2.4, verlet's limit is 2: --step 1/134 or --integrator rk4"),
        (9.0, 2.0, "verlet", "ω·h = 9, verlet's limit is 2: --step 1/500"),
        (0.3, 0.0, "explicit-euler", "explicit-euler always gains energy: --integrator verlet"),
        (9.0, 0.0, "explicit-euler", "explicit-euler always gains energy: --integrator verlet --step 1/500"),
    ],
)
def test_the_advice_is_a_step_within_the_limit(omega_h: float, limit: float, integrator: str, advice: str) -> None:
    assert advise_step(omega_h, limit, 1 / 100, integrator) == advice
