"""Pictures of reports: a title computed from the run, energy, step error and poses."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from anim.show.plots.simulation_plot import simulation_plot
from anim.simulation.comparison import Comparison, IntegratorRun, compare_integrators
from anim.simulation.integrators import oscillator
from anim.simulation.report import RunHistory, SimulationReport


def _history(errors: int = 50) -> RunHistory:
    times = np.linspace(0, 1, 50)
    height = 2 - 4.9 * times**2
    positions = np.stack([times, height, 0 * times], axis=1)[:, None, :]
    energies = {"kinetic": 48 * times**2, "potential": 9.81 * height, "total": 20 - 0.5 * times}
    return RunHistory(times, energies, positions, np.empty((0, 2), np.int64), np.linspace(0, 1e-3, errors))


def test_the_title_and_the_curves_are_those_of_the_run() -> None:
    energy = {"start": 120.0, "end": 119.5, "peak": 120.0}  # above another zero than the curves
    report = SimulationReport("rigid", 1 / 240, 240, 60, 1.0, energy_j=energy, error_estimate_m=1e-3)
    drawn = simulation_plot(_with(report, history=_history()), kind="svg").decode()
    for words in (
        "rigid: steps of 1/240 s, 1 s: energy 20 → 19.5 J",
        "a run with half the step differs by up to 1 mm",
        "kinetic",
        "potential",
        "total",
        "Energy, J, above the lowest potential",
        "Distance to the run with half the step, mm",
    ):
        assert words in drawn
    assert "Distance to" not in simulation_plot(_with(report, history=_history(0)), kind="svg").decode()


def test_a_run_that_diverges_says_when_and_what_to_do() -> None:
    report = SimulationReport("rigid", 0.1, 7, 60, 1.0, first_bad_step=7, advice="a smaller --step: 1/20")
    drawn = simulation_plot(report, kind="svg").decode()
    assert "diverges at 0.7 s" in drawn
    assert "a smaller --step: 1/20" in drawn


@pytest.mark.parametrize(
    ("method", "marked", "words"),
    [("rk4", 2, ""), ("exact oscillators", 0, "; this run is by none of them")],
)
@pytest.mark.parametrize("history", [None, _history()])
def test_a_system_is_drawn_by_every_integrator(
    history: RunHistory | None, method: str, marked: int, words: str
) -> None:
    """Below the run: the comparison was the picture, so that explicit Euler of its title looked like the run."""
    system, x = oscillator(20), np.array([[0.0, 0, 0], [1.0, 0, 0]])

    def compare() -> Comparison:
        runs = compare_integrators(system, x, 0 * x, step=1 / 60, duration=1)
        return Comparison(runs, 20 / 60, 1 / 60, np.array([[0, 1]]), about="springs let go", method=method)

    report = SimulationReport("springs", 1 / 60, 60, 60, 1.0, compare=compare, history=history)
    drawn = simulation_plot(report, kind="svg").decode()
    assert f"springs: steps of 1/60 s, 1 s, by {method}" in drawn
    assert f"For comparison: springs let go, by every integrator{words}" in drawn
    assert drawn.count("this run&#x27;s") + drawn.count("this run's") == marked, "of the label and of the motion"
    assert "explicit-euler" in drawn


def test_rounding_is_no_result() -> None:
    """Free fall, which most integrators get right: "within −5.4e−13 … +2.2e−14 %", beyond the edge of its column."""
    times, x = np.linspace(0, 1, 50), np.zeros((50, 1, 3))
    energies = 5 + 1e-14 * np.sin(9 * times)
    runs = [IntegratorRun(name, times, energies, x, x, None) for name in ("verlet", "rk4", "implicit-euler")]
    compared = Comparison(runs, 0.0, 1 / 240, np.empty((0, 2), np.int64), method="verlet")
    report = SimulationReport("particles", 1 / 240, 240, 60, 1.0, error_estimate_m=1.3e-14, compare=lambda: compared)
    drawn = simulation_plot(report, kind="svg").decode()
    assert "within +0 … +0 %" in drawn
    assert drawn.count("+0 % after 1 s") == 2
    assert "a run with half the step differs by up to &lt;1 nm" in drawn


def test_what_the_picture_needs_is_not_in_the_json() -> None:
    report = SimulationReport("rigid", 1 / 240, 240, 60, 1.0, history=_history())
    found = json.loads(json.dumps(report.to_json()))
    assert not {"history", "compare"} & set(found)


def _with(report: SimulationReport, history: RunHistory) -> SimulationReport:
    return replace(report, history=history)
