"""Document + emitter + forces → document with a clip of particles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from anim.errors import RangeError
from anim.gltf.authoring import add_clips
from anim.gltf.document import Document, Json
from anim.gltf.writing.append import append_mesh, append_nodes
from anim.gltf.writing.writer import replace_clips
from anim.model import Clip, Scene
from anim.simulation.integrators import INTEGRATORS
from anim.simulation.particles import tracks
from anim.simulation.particles.emission import Births, Emitter, emit, repeat_births
from anim.simulation.particles.forces import Forces
from anim.simulation.particles.obstacles import Obstacle
from anim.simulation.particles.solver import Contact, ParticleKeys, ParticleSolver
from anim.simulation.report import SimulationReport, advise_step
from anim.simulation.steps import Steps

MATERIAL: Json = {
    "name": "particle",
    "pbrMetallicRoughness": {"baseColorFactor": [1.0, 0.45, 0.1, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.6},
    "emissiveFactor": [1.0, 0.4, 0.05],
}


@dataclass(frozen=True, slots=True)
class ParticleOptions:
    """Forces, obstacles and time of a run.

    step: s, the longest; it is shortened so that it divides a frame. loop: begin with the particles that are alive at
    the end. size: m, radius of a particle. start: s, of the driving clip, the time of the simulation's 0.
    """

    forces: Forces = field(default_factory=Forces)
    obstacles: tuple[Obstacle, ...] = ()
    contact: Contact = field(default_factory=Contact)
    integrator: str = "velocity-verlet"
    step: float = 1 / 240
    fps: float = 60.0
    duration: float = 2.0
    warm_up: float = 0.0
    loop: bool = False
    seed: int = 0
    size: float = 0.01
    start: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class ParticleRun:
    """Result of a run: paths by node, and the report."""

    nodes: list[list[tracks.ParticlePath]]
    report: SimulationReport


def simulate_particles(scene: Scene, clip: Clip, emitter: Emitter, options: ParticleOptions) -> ParticleRun:
    """Return the paths of all particles. Raises UnstableError, or RangeError for a run without particles."""
    substeps = max(1, int(np.ceil(1 / (options.fps * options.step) - 1e-9)))
    step = 1 / (options.fps * substeps)
    start = 0.0 if options.loop else -options.warm_up
    births = emit(scene, clip, emitter, start, options.duration, options.seed, options.start)
    if options.loop:
        births = repeat_births(births, options.duration)
    if not len(births):
        raise RangeError("no particle is emitted", help="raise the rate, the burst or the duration")
    steps = Steps(step, options.duration, max(0.0, -float(births.times.min())))
    keys = _solve(births, options, steps, substeps)
    finer = Steps(step / 2, options.duration, steps.warm_up_s)
    error = _distance(keys, _solve(births, options, finer, 2 * substeps))
    nodes = tracks.share_nodes(tracks.split_paths(keys, options.start))
    return ParticleRun(nodes, _report(births, keys, options, steps, error, len(nodes)))


def add_particles(
    document: Document, run: ParticleRun, options: ParticleOptions, name: str, merge: tuple[int, Clip] | None = None
) -> Document:
    """Return the document with a mesh, a node for every particle alive at a time, and a clip that moves them.

    merge: index and clip that gets the tracks, instead of a new one.
    """
    corners, faces = tracks.octahedron()
    document, mesh = append_mesh(document, name, corners, faces, normals=corners, material=MATERIAL)
    digits = len(str(len(run.nodes) - 1))
    made: list[Json] = [
        {"name": f"{name}_{i:0{digits}}", "mesh": mesh, "translation": _start(paths), "scale": [0.0, 0.0, 0.0]}
        for i, paths in enumerate(run.nodes)
    ]
    document, indices = append_nodes(document, made)
    moving = [
        track
        for node, paths in zip(indices, run.nodes, strict=True)
        for track in tracks.make_tracks(node, paths, options.size, options.start + options.duration, options.start)
    ]
    if merge is not None:
        number, clip = merge
        return replace_clips(document, {number: Clip(clip.name, (*clip.tracks, *moving))})
    return add_clips(document, [Clip(name, tuple(moving))])


def _solve(births: Births, options: ParticleOptions, steps: Steps, substeps: int) -> ParticleKeys:
    solver = ParticleSolver(births, options.forces, options.obstacles, options.contact, options.integrator)
    return solver.run(steps, substeps)


def _distance(keys: ParticleKeys, finer: ParticleKeys) -> float:
    """Largest distance between both runs at keys of the same particle and time; impacts are left out."""
    rows = [np.stack([each.particles, np.round(each.times * 1e7)], axis=1).astype(np.int64) for each in (keys, finer)]
    table = {tuple(row): i for i, row in enumerate(rows[1].tolist())}
    pairs = [(i, table[tuple(row)]) for i, row in enumerate(rows[0].tolist()) if tuple(row) in table]
    if not pairs:
        return 0.0
    a, b = np.array(pairs).T
    return float(np.linalg.norm(keys.positions[a] - finer.positions[b], axis=1).max())


def _report(
    births: Births, keys: ParticleKeys, options: ParticleOptions, steps: Steps, error: float, num_nodes: int
) -> SimulationReport:
    omega_h = options.forces.drag_rate(keys.max_speed) * steps.step_s
    limit = INTEGRATORS[options.integrator].limit
    figures = {
        "particles": len(births),
        "nodes": num_nodes,
        "keys": len(keys.times),
        "impacts": keys.num_impacts,
        "max_speed_m_s": keys.max_speed,
        "max_step_m": keys.max_speed * steps.step_s,
    }
    return SimulationReport(
        "particles",
        steps.step_s,
        steps.num_steps,
        options.fps,
        options.duration,
        warm_up_s=steps.warm_up_s,
        integrator=options.integrator,
        omega_h=omega_h or None,
        omega_h_limit=limit if omega_h else None,
        error_estimate_m=error,
        figures=figures,
        advice=advise_step(omega_h, limit, steps.step_s, options.integrator) if limit else "",
    )


def _start(paths: Sequence[tracks.ParticlePath]) -> list[float]:
    return [round(float(value), 6) for value in paths[0].positions[0]]
