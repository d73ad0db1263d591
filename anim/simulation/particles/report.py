"""Report of a run of particles: stability, energy, error, and the same particles by every integrator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anim.arrays import Floats, Ints
from anim.simulation.comparison import MAX_ENERGY_FACTOR, Comparison, IntegratorRun
from anim.simulation.integrators import INTEGRATORS
from anim.simulation.particles.emission import Births
from anim.simulation.particles.key_paths import evaluate_keys
from anim.simulation.particles.node_motion import NodeMotion
from anim.simulation.particles.options import ParticleOptions
from anim.simulation.particles.solver import DivergedError, ParticleKeys, ParticleSolver
from anim.simulation.report import SimulationReport, advise_drag_step, advise_half_step, advise_step
from anim.simulation.steps import Steps

ABOUT = "some of the particles, all emitted at 0 s"
MAX_COMPARED = 60  # particles; more don't show more
COMPARED_S = 3.0
NO_EDGES: Ints = np.zeros((0, 2), np.int64)


def make_report(
    births: Births,
    keys: ParticleKeys,
    options: ParticleOptions,
    steps: Steps,
    motion: NodeMotion,
    *,
    num_nodes: int,
    error: float | None = None,
    num_estimated: int = 0,
    seam: float | None = None,
    reduction: float | None = None,
) -> SimulationReport:
    """Return the report of a run.

    error: m, of half the step, of `num_estimated` particles. seam: m. reduction: m, error of the removal of keys.
    """
    value, limit, advice = _stability(options, steps.step_s, keys.max_speed)
    energy = options.mass * keys.energies[:, 1:].sum(axis=1)
    figures = {
        "particles": len(births),
        "nodes": num_nodes,
        "keys": len(keys.times),
        "impacts": keys.num_impacts,
        "born_inside": keys.num_inside,
        "max_speed_m_s": keys.max_speed,
        "max_step_m": keys.max_speed * steps.step_s,
        "estimated_particles": num_estimated,
    }
    if reduction is not None:
        figures["max_error_m"] = reduction
    return replace(
        _unrun_report(births, options, steps, motion, advice),
        omega_h=value,
        omega_h_limit=limit,
        energy_j={"start": float(energy[0]), "end": float(energy[-1]), "peak": float(energy.max())},
        drift_per_s=keys.drift,
        penetration_m=keys.penetration if options.obstacles else None,
        error_estimate_m=error,
        loop_seam_m=seam,
        figures=figures,
    )


def make_failed_report(
    births: Births, options: ParticleOptions, steps: Steps, motion: NodeMotion, error: DivergedError
) -> SimulationReport:
    """Return the report of a run that diverges, with advice."""
    speed = float(np.linalg.norm(births.velocities, axis=1).max(initial=0.0))
    value, limit, advice = _stability(options, steps.step_s, speed)
    return replace(
        _unrun_report(births, options, steps, motion, advice or advise_half_step(steps.step_s)),
        omega_h=value,
        omega_h_limit=limit,
        first_bad_step=error.step,
        figures={"particles": len(births)},
    )


def _unrun_report(
    births: Births, options: ParticleOptions, steps: Steps, motion: NodeMotion, advice: str
) -> SimulationReport:
    return SimulationReport(
        "particles",
        steps.step_s,
        steps.num_steps,
        options.fps,
        options.duration,
        warm_up_s=steps.warm_up_s,
        integrator=options.integrator,
        advice=advice,
        compare=lambda: compare_particles(births, options, motion, steps.step_s),
    )


def _stability(options: ParticleOptions, step: float, speed: float) -> tuple[float | None, float | None, str]:
    """The drag or angular frequency times the step, whichever is nearer its limit, that limit, and advice."""
    method = INTEGRATORS[options.integrator]
    drag = options.forces.drag_rate(speed + float(np.linalg.norm(options.forces.wind))) * step
    omega = float(np.sqrt(sum(each.max_frequency**2 for each in options.attractors))) * step
    if not drag and not omega:
        return None, None, ""
    if omega and (not method.limit or omega / method.limit >= drag / method.drag_limit):
        return omega, method.limit, advise_step(omega, method.limit, step, options.integrator)
    limit = method.drag_limit
    return drag, limit, advise_drag_step(drag, limit, step, options.integrator)


def compare_particles(births: Births, options: ParticleOptions, motion: NodeMotion, step: float) -> Comparison:
    """Return some of the particles, all emitted at 0 s and living to the end, by every integrator."""
    chosen = np.unique(np.linspace(0, len(births) - 1, MAX_COMPARED).round().astype(np.int64))
    longest = float((births.deaths - births.times).max())
    duration = max(min(longest, COMPARED_S, options.duration), step)
    sample = Births(
        np.zeros(len(chosen)), np.full(len(chosen), np.inf), births.positions[chosen], births.velocities[chosen]
    )
    runs = [_run(name, sample, options, motion, Steps(step, duration)) for name in INTEGRATORS]
    lowest = min(float(run.energies[:, 1].min()) for run in runs)
    made = [_above(run, lowest) for run in runs]
    speed = float(np.linalg.norm(births.velocities, axis=1).max(initial=0.0))
    value, _, _ = _stability(options, step, speed)
    is_drag = value is not None and not options.attractors
    equation = "drag" if is_drag else "oscillator"
    return Comparison(made, value or 0.0, step, NO_EDGES, equation, about=ABOUT, method=options.integrator)


def _run(name: str, births: Births, options: ParticleOptions, motion: NodeMotion, steps: Steps) -> IntegratorRun:
    """Run of one integrator, whose energies (n, 2) are the total and the potential one."""
    solver = ParticleSolver(
        births, options.forces, options.obstacles, options.contact, name, options.attractors, motion
    )
    diverged = None
    try:
        keys = solver.run(steps, 1)
    except DivergedError as error:
        diverged = max(error.step, 1) * steps.step_s
        keys = solver.run(Steps(steps.step_s, diverged), 1) if error.step > 1 else _at_start(births, steps)
    times: Floats = steps.step_s * np.arange(len(keys.energies), dtype=np.float64)
    particles = np.tile(np.arange(len(births)), len(times))
    positions, velocities, _ = evaluate_keys(keys, particles, np.repeat(times, len(births)))
    shape = (len(times), len(births), 3)
    energies = options.mass * np.stack([keys.energies[:, 1:].sum(axis=1), keys.energies[:, 2]], axis=1)
    return IntegratorRun(name, times, energies, positions.reshape(shape), velocities.reshape(shape), diverged)


def _above(run: IntegratorRun, lowest: float) -> IntegratorRun:
    """The run with its total energy above the lowest potential one, until it diverges."""
    energies: Floats = np.maximum(run.energies[:, 0] - lowest, 1e-300)
    bad = np.flatnonzero(energies > MAX_ENERGY_FACTOR * energies[0])
    diverged = run.diverged_at if not len(bad) else float(run.times[bad[0]])
    end = max(int(bad[0]), 1) if len(bad) else len(energies)
    return IntegratorRun(run.name, run.times[:end], energies[:end], run.positions[:end], run.velocities[:end], diverged)


def _at_start(births: Births, steps: Steps) -> ParticleKeys:
    """Keys of particles that stay where they are born: of a run that diverges in its first steps."""
    count = len(births)
    particles = np.repeat(np.arange(count), 2)
    times = np.tile([0.0, steps.step_s], count)
    rest = np.zeros((2 * count, 3))
    energies = np.zeros((1, 3))
    energies[0, 1] = 0.5 * float(np.square(births.velocities).sum())
    return ParticleKeys(
        particles, times, np.repeat(births.positions, 2, axis=0), rest, rest, 0, 0.0, 0.0, energies, 0.0, 0
    )
