"""One cloth by every integrator and solver, for the plot of stability."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anim.arrays import Floats
from anim.errors import UnstableError
from anim.model import Clip
from anim.simulation.cloth.driver import ClothDriver
from anim.simulation.cloth.mass_spring_solver import as_mass_spring
from anim.simulation.cloth.model import ClothModel
from anim.simulation.cloth.options import ClothOptions
from anim.simulation.cloth.runs import run_solver
from anim.simulation.comparison import Comparison, IntegratorRun, compare_integrators

ABOUT = "the cloth as it is at 0 s, let go without colliders and wind"
MAX_COMPARED_S = 1.0
START_PER_EDGE = 0.002
MAX_POINT_STEPS = 150_000  # points times steps: implicit Euler solves a linear system in each


def compare(model: ClothModel, driver: ClothDriver, options: ClothOptions, substeps: int) -> Comparison:
    """Return the cloth at the pose of 0 s, without colliders and wind, by every integrator and solver.

    It is let go for a second, or less if it has many points. Points begin 0.2 % of an edge away, at random: an upright
    sheet would stay in its plane.
    """
    fabric, environment = options.fabric, replace(options.environment, wind=(0.0, 0.0, 0.0), floor=None)
    system = as_mass_spring(model, fabric, environment, options.stiffness)
    random = np.random.default_rng(environment.seed).standard_normal(model.rest.shape)
    free = (model.inverse_masses > 0)[:, None]
    x = model.rest + START_PER_EDGE * float(model.edge_lengths.mean()) * random * free
    step = 1.0 / (options.fps * substeps)
    steps = max(min(options.duration / step, MAX_COMPARED_S / step, MAX_POINT_STEPS / len(x)), 2)
    duration = round(steps) * step
    size = float(np.linalg.norm(np.ptp(x, axis=0)))
    weight = float(system.masses[system.is_free].sum() * np.linalg.norm(environment.gravity))
    lowest = system.energy(x, np.zeros_like(x)) - weight * size
    runs = compare_integrators(system, x, np.zeros_like(x), step=step, duration=duration, lowest_energy=lowest)
    resting = replace(driver, clip=Clip("", ()), obstacles=())
    loose = replace(options, environment=environment)
    for name in ("relaxation", "xpbd"):
        runs.append(_run(model, resting, replace(loose, solver=name), x, step, duration, lowest))
    method = options.integrator if options.solver == "mass-spring" else options.solver
    stiffest = system.max_frequency() * step
    return Comparison(_from_lowest(runs), stiffest, step, model.topology.edges, about=ABOUT, method=method)


def _from_lowest(runs: list[IntegratorRun]) -> list[IntegratorRun]:
    """The runs with energies above the lowest of those that don't diverge."""
    found = [run.energies for run in runs if run.diverged_at is None] or [run.energies[:1] for run in runs]
    lowest = min(float(each.min()) for each in found)
    start = max(float(run.energies[0]) for run in runs)
    lowest -= 1e-3 * max(start - lowest, 1e-12)
    return [replace(run, energies=run.energies - lowest) for run in runs]


def _run(
    model: ClothModel,
    driver: ClothDriver,
    options: ClothOptions,
    start: Floats,
    step: float,
    duration: float,
    lowest: float,
) -> IntegratorRun:
    """The cloth by a solver that moves points, with a frame for each step."""
    positions: list[Floats] = []
    energies: list[float] = []
    diverged = None
    timing = {"fps": 1 / step, "num_frames": round(duration / step) + 1, "substeps": 1}
    try:
        for x, energy in run_solver(model, driver, options, **timing, start=start):
            positions.append(x)
            energies.append(energy - lowest)
    except UnstableError:
        diverged = len(positions) * step
    found, times = np.array(positions), step * np.arange(len(positions), dtype=np.float64)
    velocities = np.gradient(found, step, axis=0) if len(found) > 1 else np.zeros_like(found)
    return IntegratorRun(options.solver, times, np.array(energies), found, velocities, diverged)
