"""Pictures of integrators: phase space with one scale for all."""

from __future__ import annotations

import itertools

import numpy as np

from anim.show.plots.figure import Figure, style
from anim.show.plots.stability_equations import TEST_EQUATIONS
from anim.show.plots.stability_plot import STABILITY_HEIGHT, WIDTH, draw_gain, motion_points
from anim.simulation.comparison import compare_integrators
from anim.simulation.integrators import oscillator


def test_phase_space_has_the_same_scale_for_every_integrator() -> None:
    """At ω·h = 2 implicit Euler's first step goes from (1, 0) to (0.2, −0.4); velocities were stretched to the ends."""
    system = oscillator(20.0)
    start = np.array([[0.0, 0, 0], [1, 0, 0]])
    runs = compare_integrators(system, start, np.zeros((2, 3)), step=0.1, duration=1.0, names=["implicit-euler"])
    points = motion_points(runs[0], np.array([[0, 1]]), 20.0)
    np.testing.assert_allclose(points[:2, 0], np.array([[1.0, 0.0], [0.2, -0.4]]), atol=1e-12)


def test_words_and_limits_of_the_gain_do_not_overlap() -> None:
    """ "fades" was on the dashed line of a small step, and the limits' names on the curves below them."""
    for step in (0.004, 0.0167, 0.05, 0.095, 0.14, 0.168):
        for name, equation in TEST_EQUATIONS.items():
            with style("png"):
                sheet = Figure(WIDTH, STABILITY_HEIGHT)
                axes = draw_gain(sheet, equation, 20 * step)
                sheet.figure.canvas.draw()
                boxes = [each.get_window_extent() for each in axes.texts]
                at = axes.transData.transform([[20 * step, 1.0]])[0, 0]
            for a, b in itertools.combinations(boxes, 2):
                assert not a.overlaps(b), (name, step)
            assert not any(box.x0 < at < box.x1 for box in boxes[-3:]), (name, step)
