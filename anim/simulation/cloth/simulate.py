"""Scene + clip + options → vertex cache of a cloth, and its report."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from anim.arrays import Bools, Floats
from anim.errors import RangeError, UnstableError
from anim.model import Clip, FrameChunk, Scene, VertexCache
from anim.simulation.cloth.driver import Capsule, ClothDriver
from anim.simulation.cloth.mass_spring_solver import as_mass_spring, run_mass_spring
from anim.simulation.cloth.model import ClothModel, Fabric, build_cloth
from anim.simulation.cloth.solver import Environment, run_xpbd
from anim.simulation.comparison import Comparison, compare_integrators
from anim.simulation.integrators import INTEGRATORS
from anim.simulation.report import SimulationReport, advise_elongation, advise_step, describe_elongation
from anim.skinning.bake import prepare_bake

SOLVERS = {
    "xpbd": "extended position-based dynamics, stiff at any step",
    "mass-spring": "springs, by a time integrator",
    "relaxation": "Verlet with relaxed distances, as stiff as it has iterations",
}
MAX_SUBSTEPS = 80
XPBD_SWEEPS = 2  # of the constraints per substep: half the stretch for 1.5 times the time
COMPARED_S = 1.0  # of the integrators


@dataclass(frozen=True, slots=True)
class ClothOptions:
    """Fabric, surroundings, solver and time of a cloth.

    solver: a name in SOLVERS. substeps: per frame. iterations: of the constraints per substep, for relaxation.
    max_stretch: doubles the substeps until no edge is longer than this fraction; None for no limit.
    stiffness: N/m, of mass-spring. self_collision, tethers: switches. estimate_error: simulate a second time with half
    the step. duration, warm_up: s, rounded to whole frames.
    """

    fabric: Fabric = field(default_factory=Fabric)
    environment: Environment = field(default_factory=Environment)
    capsules: tuple[Capsule, ...] = ()
    solver: str = "xpbd"
    integrator: str = "velocity-verlet"
    substeps: int = 10
    iterations: int = 20
    max_stretch: float | None = None
    stiffness: float = 500.0
    self_collision: bool = False
    tethers: bool = True
    fps: float = 60.0
    duration: float = 2.0
    warm_up: float = 0.0
    estimate_error: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class ClothRun:
    """Frames of all vertices of the mesh, and the report."""

    cache: VertexCache
    report: SimulationReport


@dataclass(frozen=True, slots=True, eq=False)
class _Frames:
    positions: Floats  # (F, P, 3)
    energies: Floats | None  # (F,)


def simulate_cloth(scene: Scene, clip: Clip, node: int, pinned: Bools, options: ClothOptions) -> ClothRun:
    """Return the cloth of a mesh over a clip.

    node: of the mesh instance. pinned: (V,) vertices that follow the animation; all others are simulated.
    Raises RangeError, NotFoundError for a mesh without edges or free points, UnstableError with a report.
    """
    if options.solver not in SOLVERS:
        raise RangeError(f"unknown `solver` '{options.solver}' (expected {', '.join(SOLVERS)})")
    baker = prepare_bake(scene, rigid=True, nodes=[node])
    template = baker.bake(Clip("", ()), times=np.zeros(1))
    start = np.concatenate([chunk.positions for chunk in template.chunks()])[0].astype(np.float64)
    model = build_cloth(start, template.faces, pinned, options.fabric, self_collision=options.self_collision)
    driver = ClothDriver(baker, clip, model.topology.first_vertex[model.pinned], scene, options.capsules)
    substeps, frames = _run(model, driver, options)
    error = None
    if options.estimate_error:
        finer = _simulate(model, driver, options, 2 * substeps)
        error = float(np.linalg.norm(finer.positions - frames.positions, axis=2).max())
    times = clip.start + np.arange(len(frames.positions), dtype=np.float64) / options.fps
    positions = frames.positions[:, model.topology.point_of_vertex].astype(np.float32)
    cache = replace(template, times=times, chunks=lambda: iter((FrameChunk(0, positions),)), rest=start)
    return ClothRun(cache, _report(model, options, substeps, frames, error))


def _run(model: ClothModel, driver: ClothDriver, options: ClothOptions) -> tuple[int, _Frames]:
    """Frames with as many substeps as `max_stretch` needs, up to MAX_SUBSTEPS."""
    substeps = options.substeps
    while True:
        frames = _simulate(model, driver, options, substeps)
        enough = options.max_stretch is None or _elongation(model, frames.positions).max() <= options.max_stretch
        if enough or 2 * substeps > MAX_SUBSTEPS:
            return substeps, frames
        substeps *= 2


def _simulate(model: ClothModel, driver: ClothDriver, options: ClothOptions, substeps: int) -> _Frames:
    num_frames = round(options.duration * options.fps) + 1
    timing: dict[str, Any] = {
        "fps": options.fps,
        "num_frames": num_frames,
        "substeps": substeps,
        "warm_up_frames": round(options.warm_up * options.fps),
    }
    if options.solver == "mass-spring":
        return _simulate_mass_spring(model, driver, options, timing)
    fabric, iterations = options.fabric, XPBD_SWEEPS
    if options.solver == "relaxation":
        fabric, iterations = replace(fabric, stretch_compliance=0.0, bend_compliance=0.0), options.iterations
    try:
        found = list(
            run_xpbd(
                model, fabric, options.environment, driver, **timing, iterations=iterations, tethers=options.tethers
            )
        )
    except UnstableError as error:
        raise error.with_report(_report(model, options, substeps, None, None)) from None
    return _Frames(np.array(found), None)


def _simulate_mass_spring(
    model: ClothModel, driver: ClothDriver, options: ClothOptions, timing: dict[str, Any]
) -> _Frames:
    system = as_mass_spring(model, options.fabric, options.environment, options.stiffness)
    positions, energies = [], []
    try:
        for x, v in run_mass_spring(
            model, system, options.fabric, options.environment, driver, integrator=options.integrator, **timing
        ):
            positions.append(x)
            energies.append(system.energy(x, v))
    except UnstableError as error:
        found = _report(model, options, timing["substeps"], None, None, first_bad_frame=len(positions))
        raise error.with_report(found).advise(found.advice) from None
    return _Frames(np.array(positions), np.array(energies))


def _elongation(model: ClothModel, positions: Floats) -> Floats:
    """Relative elongation (F, E) of the edges with a free end; 0 where there is none."""
    a, b = model.topology.edges.T
    lengths = np.linalg.norm(positions[:, a] - positions[:, b], axis=2)
    free = (model.inverse_masses[a] + model.inverse_masses[b]) > 0
    return np.asarray(np.where(free, lengths / model.edge_lengths - 1, 0.0))


def _report(
    model: ClothModel,
    options: ClothOptions,
    substeps: int,
    frames: _Frames | None,
    error: float | None,
    first_bad_frame: int | None = None,
) -> SimulationReport:
    step = 1.0 / (options.fps * substeps)
    omega_h = limit = None
    advice = ""
    if options.solver == "mass-spring":
        system = as_mass_spring(model, options.fabric, options.environment, options.stiffness)
        omega_h, limit = system.max_frequency() * step, INTEGRATORS[options.integrator].limit
        advice = advise_step(omega_h, limit, step, options.integrator)
    worst = None if frames is None else _worst_stretch(model, frames.positions, options.fps)
    if not advice and describe_elongation(worst, substeps, options.max_stretch):
        advice = advise_elongation(options.solver)
    return SimulationReport(
        "cloth",
        step,
        round(options.duration / step),
        options.fps,
        options.duration,
        options.warm_up,
        options.integrator if options.solver == "mass-spring" else "",
        omega_h,
        limit,
        energy_j=None if frames is None or frames.energies is None else _energy(frames.energies),
        worst_stretch=worst,
        first_bad_step=None if first_bad_frame is None else first_bad_frame * substeps,
        error_estimate_m=error,
        figures={
            "solver": options.solver,
            "substeps": substeps,
            "points": len(model.rest),
            "pinned": len(model.pinned),
            "edges": len(model.topology.edges),
        },
        advice=advice,
    )


def _energy(energies: Floats) -> dict[str, float]:
    return {"start": float(energies[0]), "end": float(energies[-1]), "peak": float(energies.max())}


def _worst_stretch(model: ClothModel, positions: Floats, fps: float) -> dict[str, Any]:
    found = _elongation(model, positions)
    frame, edge = np.unravel_index(int(found.argmax()), found.shape)
    where = positions[frame, model.topology.edges[edge]].mean(axis=0)
    return {
        "fraction": float(found[frame, edge]),
        "where": [round(float(value), 6) for value in where],
        "time_s": float(frame / fps),
        "at_end": float(found[-1].max()),
    }


def compare(scene: Scene, node: int, pinned: Bools, options: ClothOptions) -> Comparison:
    """Return the same cloth as masses and springs by every integrator, over a second at the pose of 0 s."""
    baker = prepare_bake(scene, rigid=True, nodes=[node])
    template = baker.bake(Clip("", ()), times=np.zeros(1))
    start = np.concatenate([chunk.positions for chunk in template.chunks()])[0].astype(np.float64)
    model = build_cloth(start, template.faces, pinned, options.fabric)
    system = as_mass_spring(model, options.fabric, options.environment, options.stiffness)
    x, v = model.rest, np.zeros_like(model.rest)
    step, duration = 1.0 / (options.fps * options.substeps), min(options.duration, COMPARED_S)
    damped = compare_integrators(system, x, v, step=step, duration=duration, names=["implicit-euler"])[0]
    lowest = float(damped.energies.min()) - 1e-3 * abs(float(np.ptp(damped.energies)))
    runs = compare_integrators(system, x, v, step=step, duration=duration, lowest_energy=lowest)
    return Comparison(runs, system.max_frequency() * step, step, model.topology.edges)
