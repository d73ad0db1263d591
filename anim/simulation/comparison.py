"""The same system by every integrator: energy over time, and when it diverges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from anim.arrays import Floats, Ints
from anim.simulation.integrators import INTEGRATORS, System, integrate

MAX_ENERGY_FACTOR = 1e6  # of the start; beyond, a run has diverged


class EnergySystem(System, Protocol):
    """System with an energy in J at positions and velocities (P, 3)."""

    def energy(self, x: Floats, v: Floats) -> float: ...


@dataclass(frozen=True, slots=True, eq=False)
class IntegratorRun:
    """Run of one integrator.

    times: (n,) s. energies: (n,) J above the lowest possible. positions, velocities: (n, P, 3).
    diverged_at: s, None if it doesn't diverge.
    """

    name: str
    times: Floats
    energies: Floats
    positions: Floats
    velocities: Floats
    diverged_at: float | None

    @property
    def energy_change(self) -> float:
        """Relative change of energy from start to end."""
        return float(self.energies[-1] / self.energies[0] - 1)


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Runs of all integrators on one system. omega_h: of its stiffest part, 0 without one. step: s.

    springs: (S, 2) pairs of points to draw; with one spring the motion is drawn in phase space, without as points.
    test_equation: "oscillator", x″ = −ω²x, or "drag", x″ = −r x′, whose r·h is `omega_h`: a name in GAINS.
    about: the system in words, if it is that of a simulation, whose method is `method`: the name of one of the runs, or
    words for another one.
    """

    runs: list[IntegratorRun]
    omega_h: float
    step: float
    springs: Ints
    test_equation: str = "oscillator"
    about: str = ""
    method: str = ""


def compare_integrators(
    system: EnergySystem,
    x: Floats,
    v: Floats,
    *,
    step: float,
    duration: float,
    lowest_energy: float = 0.0,
    names: Sequence[str] = tuple(INTEGRATORS),
) -> list[IntegratorRun]:
    """Return a run for each integrator, from positions x and velocities v (P, 3), until `duration` or divergence.

    lowest_energy: J, of the system at rest, from which energies count.
    """
    return [_run(system, x, v, step, round(duration / step), lowest_energy, name) for name in names]


def _run(
    system: EnergySystem, x: Floats, v: Floats, step: float, num_steps: int, lowest: float, name: str
) -> IntegratorRun:
    states: list[tuple[Floats, Floats]] = []
    energies: list[float] = []
    diverged: float | None = None
    for n, (position, velocity) in enumerate(integrate(system, name, x, v, step, num_steps)):
        with np.errstate(all="ignore"):
            energy = system.energy(position, velocity) - lowest
        if not energy < MAX_ENERGY_FACTOR * max(energies[0] if energies else energy, 1e-30):
            diverged = n * step
            break
        states.append((position, velocity))
        energies.append(energy)
    if diverged is None and len(states) <= num_steps:
        diverged = len(states) * step
    times = np.arange(len(states), dtype=np.float64) * step
    positions, velocities = (np.array(each) for each in zip(*states, strict=True))
    return IntegratorRun(name, times, np.array(energies), positions, velocities, diverged)
