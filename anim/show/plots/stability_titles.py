"""Title and subtitle of the plot of integrators, from their runs."""

from __future__ import annotations

from collections.abc import Sequence

from anim.show.plots.figure import format_number
from anim.show.plots.stability_equations import TestEquation
from anim.simulation.comparison import IntegratorRun
from anim.simulation.integrators import INTEGRATORS

MAX_GAIN_OF_ENERGY = 1.0  # relative; runs that more than double it are named


def title(runs: Sequence[IntegratorRun], equation: TestEquation, omega_h: float, step: float) -> str:
    """Return the step and the result of the runs: those that diverge, else those that gain energy, else none."""
    gone = [run for run in runs if run.diverged_at is not None]
    stable = [run.name for run in runs if run.diverged_at is None]
    growing = [run for run in runs if run.energy_change > MAX_GAIN_OF_ENERGY]
    if not gone and growing:
        most = max(growing, key=lambda run: run.energy_change)
        others = ", others less" if len(growing) > 1 else ""
        factor = format_number(float(f"{1 + most.energy_change:.3g}"))
        result = f"{most.name} gains energy ×{factor} in {float(most.times[-1]):.2g} s{others}"
    elif not gone:
        result = f"no integrator diverges within {max(float(run.times[-1]) for run in runs):.2g} s"
    elif len(gone) == len(runs):
        result = "every integrator diverges"
    elif len(gone) > len(stable):
        result = f"all but {', '.join(stable)} diverge"
    else:
        words = [f"{run.name} ({run.diverged_at:.2f} s)" if len(gone) < 3 else run.name for run in gone]
        result = f"{', '.join(words)} diverge{'s' if len(gone) == 1 else ''}"
    value = f", {equation.symbol} = {format_product(omega_h)}" if omega_h > 0 else ""
    return f"Step {format_step(step)}{value}: {result}"


def format_product(omega_h: float) -> str:
    """Return ω·h with two decimals, or two digits if it is small."""
    return f"{omega_h:.2f}" if omega_h >= 0.1 else format_number(float(f"{omega_h:.2g}"))


def subtitle(equation: TestEquation, omega_h: float, step: float) -> str:
    """Return the largest stable steps of some integrators."""
    if omega_h <= 0:
        return "No force depends on the position or the velocity: every step is stable."
    names = ("verlet", "rk4") if equation.symbol == "ω·h" else ("explicit-euler", "verlet", "rk4")
    limits = [f"{name} {format_step(step * equation.limit(INTEGRATORS[name]) / omega_h)}" for name in names]
    none = [f"{name} none" for name, method in INTEGRATORS.items() if equation.limit(method) == 0]
    return f"Largest stable steps of this system: {', '.join(limits)}; {', '.join(['implicit-euler any', *none])}."


def format_step(step: float) -> str:
    """Return a time step as "1/60 s", or "1.5 s" from a second on."""
    return f"1/{1 / step:.4g} s" if step < 1 else f"{step:.3g} s"
