"""Scene + clip + emitter + forces → paths of particles, and a report."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from anim.arrays import Floats
from anim.errors import DataRangeError, RangeError, UnstableError, UnsupportedError
from anim.gltf.document import Document
from anim.model import Clip, Scene
from anim.model.point_cache import PointCache
from anim.simulation.particles import gltf_output, tracks
from anim.simulation.particles.emission import Births, Emitter, place_births, plan_births, repeat_births
from anim.simulation.particles.key_paths import evaluate_keys, largest_distance, sample_points
from anim.simulation.particles.node_motion import NodeMotion
from anim.simulation.particles.options import ParticleOptions
from anim.simulation.particles.reduction import reduce_keys
from anim.simulation.particles.report import make_failed_report, make_report
from anim.simulation.particles.solver import DivergedError, ParticleKeys, ParticleSolver
from anim.simulation.report import SimulationReport
from anim.simulation.steps import Steps, count_substeps

__all__ = ["ParticleOptions", "ParticleRun", "add_particles", "simulate_particles"]

MAX_ESTIMATED = 1000  # particles of the error estimate: that of all would take twice as long as the run


@dataclass(frozen=True, slots=True, eq=False)
class ParticleRun:
    """Result of a run: paths by node, all keys with births and deaths (P,) s, and the report."""

    nodes: list[list[tracks.ParticlePath]]
    keys: ParticleKeys
    births: Births
    options: ParticleOptions
    report: SimulationReport

    def points(self) -> PointCache:
        """Return the particles alive at each frame."""
        options = self.options
        frames = Steps(options.step, options.duration).frames(options.fps)
        births = self.births
        return sample_points(self.keys, births.times, births.deaths, frames, size=options.size, start=options.start)


def simulate_particles(scene: Scene, clip: Clip, emitter: Emitter, options: ParticleOptions) -> ParticleRun:
    """Return the paths of all particles.

    Raises UnstableError with a report, RangeError for a run without particles, and UnsupportedError, before any work,
    for more at a time than `max_nodes`.
    """
    substeps = count_substeps(options.fps, options.step)
    step = 1 / (options.fps * substeps)
    start = 0.0 if options.loop else -options.warm_up
    plan = plan_births(emitter, start, options.duration, options.seed)
    if options.max_nodes is not None:
        check_simultaneous(plan.count_simultaneous(options.duration, is_loop=options.loop), options.max_nodes)
    if not plan.lifetimes.size:
        raise RangeError(
            f"no particle is emitted in {options.duration:g} s", help="raise `rate`, `burst` or `duration`"
        )
    births = place_births(scene, clip, emitter, plan, options.start)
    _check_speed(births)
    num_emitted = len(births)
    if options.loop:
        births = repeat_births(births, options.duration)
    steps = Steps(step, options.duration, max(0.0, -float(births.times.min())))
    motion = NodeMotion(scene.skeleton, clip, options.start, options.duration if options.loop else None)
    try:
        keys = _solve(births, options, motion, steps, substeps)
    except DivergedError as error:
        found = make_failed_report(births, options, steps, motion, error)
        raise UnstableError(str(error)).with_report(found).advise(found.advice) from None
    estimate = None
    if options.estimate_error:
        estimate = _estimate_error(births, keys, options, motion, steps, substeps)
    seam = _seam(keys, births, options.duration, num_emitted) if options.loop else None
    reduction = None
    written = keys
    if options.max_error:
        written, reduction = reduce_keys(keys, options.max_error)
    nodes = tracks.share_nodes(tracks.split_paths(written, options.start))
    report = make_report(
        births,
        written,
        options,
        steps,
        motion,
        num_nodes=len(nodes),
        error=estimate,
        num_estimated=min(len(births), MAX_ESTIMATED) if options.estimate_error else 0,
        seam=seam,
        reduction=reduction,
    )
    return ParticleRun(nodes, keys, births, options, report)


def check_simultaneous(count: int, max_nodes: int) -> None:
    """Raise UnsupportedError for more particles at a time than nodes that may be written."""
    if count > max_nodes:
        raise UnsupportedError(f"{count} particles at a time (limit {max_nodes} nodes)")


def _check_speed(births: Births) -> None:
    """Raise DataRangeError for particles that no run allows at birth: the emitter's own speed, whatever the step."""
    from anim.simulation.particles.kernels.particle_run import MAX_SPEED_M_S

    speed = float(np.linalg.norm(births.velocities, axis=1).max())
    if speed >= MAX_SPEED_M_S:
        raise DataRangeError(
            f"a particle is born at {speed:g} m/s, mostly the speed of its emitter (limit {MAX_SPEED_M_S:g} m/s)",
            help="lower `inherit`: with 0 particles don't inherit the emitter's speed",
        )


def add_particles(
    document: Document, run: ParticleRun, name: str, merge: tuple[int, Clip] | None = None, form: str = "node"
) -> Document:
    """Return the document with the particles of a run; see `gltf_output.add_particles`."""
    options = run.options
    end = options.start + options.duration
    return gltf_output.add_particles(
        document, run.nodes, size=options.size, start=options.start, end=end, name=name, form=form, merge=merge
    )


def _solve(births: Births, options: ParticleOptions, motion: NodeMotion, steps: Steps, substeps: int) -> ParticleKeys:
    solver = ParticleSolver(
        births,
        options.forces,
        options.obstacles,
        options.contact,
        options.integrator,
        options.attractors,
        motion,
        options.duration if options.loop else None,
    )
    return solver.run(steps, substeps)


def _estimate_error(
    births: Births, keys: ParticleKeys, options: ParticleOptions, motion: NodeMotion, steps: Steps, substeps: int
) -> float:
    """Largest distance in m of at most MAX_ESTIMATED particles, evenly chosen, to their run with half the step."""
    chosen = np.unique(np.linspace(0, len(births) - 1, min(len(births), MAX_ESTIMATED)).astype(np.int64))
    finer = Steps(steps.step_s / 2, options.duration, steps.warm_up_s)
    other = _solve(births.at(chosen), options, motion, finer, 2 * substeps)
    rows = np.flatnonzero(np.isin(keys.particles, chosen))
    same = replace(keys.at(rows), particles=np.searchsorted(chosen, keys.particles[rows]))
    return largest_distance(same, other)


def _seam(keys: ParticleKeys, births: Births, period: float, num_emitted: int) -> float:
    """Largest distance in m between a particle at the start, and the one that takes its place, at the end.

    births: those of the rounds, one after another, the last of which is the loop's own.
    """
    at_start = np.flatnonzero((births.times <= 0) & (births.deaths > 0))
    at_start = at_start[at_start + num_emitted < len(births)]
    a, _, one = evaluate_keys(keys, at_start, np.zeros(len(at_start)))
    b, _, other = evaluate_keys(keys, at_start + num_emitted, np.full(len(at_start), period))
    both = one & other
    distances: Floats = np.linalg.norm(a - b, axis=1)[both]
    return float(distances.max(initial=0.0))
