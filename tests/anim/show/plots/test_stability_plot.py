"""Pictures of integrators: phase space with one scale for all."""

from __future__ import annotations

import numpy as np

from anim.show.plots.stability_plot import motion_points
from anim.simulation.comparison import compare_integrators
from anim.simulation.mass_spring import oscillator


def test_phase_space_has_the_same_scale_for_every_integrator() -> None:
    """At ω·h = 2 implicit Euler's first step goes from (1, 0) to (0.2, −0.4); velocities were stretched to the ends."""
    system = oscillator(20.0)
    start = np.array([[0.0, 0, 0], [1, 0, 0]])
    runs = compare_integrators(system, start, np.zeros((2, 3)), step=0.1, duration=1.0, names=["implicit-euler"])
    points = motion_points(runs[0], system.springs, 20.0)
    np.testing.assert_allclose(points[:2, 0], np.array([[1.0, 0.0], [0.2, -0.4]]), atol=1e-12)
