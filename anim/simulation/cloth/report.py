"""Report of a cloth's simulation: stability, energy, elongation and penetration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from anim.arrays import Floats
from anim.simulation.cloth.comparison import compare
from anim.simulation.cloth.driver import ClothDriver
from anim.simulation.cloth.elongation import FrameElongation, attachment_elongation, measure_elongation
from anim.simulation.cloth.loop import LoopSeam
from anim.simulation.cloth.mass_spring_solver import as_mass_spring
from anim.simulation.cloth.model import ClothModel
from anim.simulation.cloth.options import ClothOptions
from anim.simulation.cloth.solver import NO_FLOOR_M
from anim.simulation.integrators import INTEGRATORS
from anim.simulation.report import (
    RunHistory,
    SimulationReport,
    advise_elongation,
    advise_half_step,
    advise_step,
    describe_elongation,
)


@dataclass(frozen=True, slots=True, eq=False)
class ClothFrames:
    """Frames of all points (F, P, 3) m, their energies (F,) J, their elongations, and the seam of a loop."""

    positions: Floats
    energies: Floats
    elongations: Sequence[FrameElongation]
    seam: LoopSeam | None = None


def make_report(
    model: ClothModel,
    driver: ClothDriver,
    options: ClothOptions,
    substeps: int,
    frames: ClothFrames,
    error: float | None,
) -> SimulationReport:
    """Return the report of a run. error: m, largest distance to the same run with half the step."""
    worst = _worst_stretch(model, frames, options.fps)
    advice = ""
    if describe_elongation(worst, substeps, options.max_stretch):
        advice = advise_elongation(
            options.solver,
            is_start=worst["time_s"] == 0,
            is_attachment=worst["attachment"] > (options.max_stretch or 0.0),
        )
    seam = frames.seam
    return _report(
        model,
        driver,
        options,
        substeps,
        advice,
        {} if seam is None else {"loop_rounds": seam.rounds, "loop_settled": seam.settled},
        energy_j=_energy(frames.energies),
        drift_per_s=_drift(model, options, frames),
        worst_stretch=worst,
        penetration_m=_penetration(model, driver, options, frames.positions),
        error_estimate_m=error,
        loop_seam_m=None if seam is None else seam.distance,
        history=_history(model, options, frames),
    )


def make_failed_report(
    model: ClothModel, driver: ClothDriver, options: ClothOptions, substeps: int, bad_frame: int
) -> SimulationReport:
    """Return the report of a run that diverges. bad_frame: index of the first frame without a finite result."""
    advice = advise_half_step(1.0 / (options.fps * substeps))
    bad_step = max(bad_frame - 1, 0) * substeps + 1
    return _report(model, driver, options, substeps, advice, {}, first_bad_step=bad_step)


def _report(
    model: ClothModel,
    driver: ClothDriver,
    options: ClothOptions,
    substeps: int,
    advice: str,
    figures: dict[str, Any],
    **measured: Any,
) -> SimulationReport:
    step = 1.0 / (options.fps * substeps)
    omega_h = limit = None
    is_mass_spring = options.solver == "mass-spring"
    if is_mass_spring:
        system = as_mass_spring(model, options.fabric, options.environment, options.stiffness)
        omega_h, limit = system.max_frequency() * step, INTEGRATORS[options.integrator].limit
        advice = advise_step(omega_h, limit, step, options.integrator) or advice
    return SimulationReport(
        "cloth",
        step,
        round(options.duration / step),
        options.fps,
        options.duration,
        options.warm_up,
        options.integrator if is_mass_spring else "",
        omega_h,
        limit,
        figures={
            "solver": options.solver,
            "substeps": substeps,
            "points": len(model.rest),
            "pinned": len(model.pinned),
            "edges": len(model.topology.edges),
            "colliders": len(options.obstacles),
            **figures,
        },
        advice=advice,
        compare=lambda: compare(model, driver, options, substeps),
        **measured,
    )


def _history(model: ClothModel, options: ClothOptions, frames: ClothFrames) -> RunHistory:
    """The run over time: energies above the lowest potential, kinetic by differences of positions."""
    times = np.arange(len(frames.positions), dtype=np.float64) / options.fps
    masses, x = model.masses, frames.positions
    potential = -(x @ np.asarray(options.environment.gravity)) @ masses
    total, potential = frames.energies - potential.min(), potential - potential.min()
    energies = {"total": total, "kinetic": _kinetic_energies(masses, times, x), "potential": potential}
    return RunHistory(times, energies, frames.positions, model.topology.edges, np.empty(0))


def _kinetic_energies(masses: Floats, times: Floats, x: Floats) -> Floats:
    """Kinetic energies (F,) J of points (F, P, 3) by central differences, frame by frame to save memory."""
    found = np.zeros(len(times))
    for k in range(len(times)):
        a, b = max(k - 1, 0), min(k + 1, len(times) - 1)
        if a < b:
            moved = x[b] - x[a]
            found[k] = 0.5 * np.einsum("p,pc,pc->", masses, moved, moved) / (times[b] - times[a]) ** 2
    return found


def _energy(energies: Floats) -> dict[str, float]:
    return {"start": float(energies[0]), "end": float(energies[-1]), "peak": float(energies.max())}


def _drift(model: ClothModel, options: ClothOptions, frames: ClothFrames) -> float | None:
    """Change of energy per second, of the largest kinetic and elastic energy; None for a cloth without motion."""
    heights = frames.positions @ np.asarray(options.environment.gravity)
    moving = float((frames.energies + heights @ model.masses).max())
    duration = (len(frames.energies) - 1) / options.fps
    if moving <= 0 or duration <= 0:
        return None
    return float(frames.energies[-1] - frames.energies[0]) / (moving * duration)


def _penetration(model: ClothModel, driver: ClothDriver, options: ClothOptions, positions: Floats) -> float | None:
    """Largest depth in m of a point in a collider or below the floor, at frames; None where there is neither."""
    from anim.simulation.cloth.kernels.collisions import deepest_penetration

    floor = options.environment.floor
    if not options.obstacles and floor is None:
        return None
    colliders = driver.colliders(np.arange(len(positions), dtype=np.float64) / options.fps)
    deepest = deepest_penetration(positions, model.inverse_masses, colliders, NO_FLOOR_M if floor is None else floor)
    return float(deepest)


def _worst_stretch(model: ClothModel, frames: ClothFrames, fps: float) -> dict[str, Any]:
    """Largest elongation of an edge with a free end at the end of any step, and those of both kinds of edges."""
    fractions = np.array([each.fractions for each in frames.elongations])
    frame, kind = np.unravel_index(int(fractions.argmax()), fractions.shape)
    worst = frames.elongations[int(frame)]
    where = frames.positions[frame, model.topology.edges[worst.edges[kind]]].mean(axis=0)
    last = measure_elongation(model, frames.positions[-1])
    free, attached = np.maximum(fractions.max(axis=0), 0.0)
    return {
        "fraction": float(fractions[frame, kind]),
        "where": [round(float(value), 6) for value in where],
        "time_s": float(frame / fps - worst.ages[kind]),
        "at_end": last.largest,
        "free_edges": float(free),
        "attached_edges": float(attached),
        "attachment": attachment_elongation(model, frames.positions),
    }
