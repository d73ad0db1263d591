"""Frames of a cloth as masses and springs, by any time integrator: what a step that is too long does."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from anim.arrays import Floats
from anim.simulation.cloth.divergence import check_motion
from anim.simulation.cloth.driver import ClothDriver
from anim.simulation.cloth.elongation import ElongationRecord, FrameElongation, measure_elongation
from anim.simulation.cloth.model import ClothModel, Fabric
from anim.simulation.cloth.solver import NO_FLOOR_M, Environment
from anim.simulation.integrators import State, Step, find_integrator
from anim.simulation.mass_spring import MassSpring

HINGE_STIFFNESS_PER_EDGE = 0.05  # stiffness of hinges, per stiffness of edges
DAMPING_RATIO = 0.02  # of the springs, at their own frequency


def as_mass_spring(model: ClothModel, fabric: Fabric, environment: Environment, stiffness: float) -> MassSpring:
    """Return the system of a cloth: a spring of `stiffness` N/m for each edge, and a softer one for each hinge."""
    springs = np.concatenate([model.topology.edges, model.topology.hinges])
    lengths = np.concatenate([model.edge_lengths, model.hinge_lengths])
    k = np.full(len(springs), stiffness)
    k[len(model.topology.edges) :] *= HINGE_STIFFNESS_PER_EDGE
    with np.errstate(divide="ignore"):
        masses = 1.0 / model.inverse_masses
    reduced = 1.0 / np.maximum(model.inverse_masses[springs].sum(axis=1), 1e-30)
    damping = np.where(np.isfinite(reduced) & (reduced < 1e20), 2 * DAMPING_RATIO * np.sqrt(k * reduced), 0.0)
    return MassSpring(masses, springs, lengths, k, damping, environment.gravity, fabric.damping)


def run_mass_spring(
    model: ClothModel,
    system: MassSpring,
    fabric: Fabric,
    environment: Environment,
    driver: ClothDriver,
    *,
    integrator: str,
    fps: float,
    num_frames: int,
    substeps: int,
    warm_up_frames: int = 0,
    record: ElongationRecord | None = None,
) -> Iterator[tuple[Floats, float]]:
    """Yield positions (P, 3) and the energy in J at frames, as `run_xpbd`. Wind is left out. Raises UnstableError."""
    from anim.simulation.cloth.kernels.collisions import push_out

    method = find_integrator(integrator)
    h = 1.0 / (fps * substeps)
    first = -warm_up_frames
    x = driver.all_vertices(first / fps)[model.topology.first_vertex]
    v = np.zeros_like(x)
    x, v = method.start(system, 0.0, x, v, h)
    floor = NO_FLOOR_M if environment.floor is None else environment.floor
    for frame in range(first, num_frames):
        if frame > first:
            times = (frame - 1) / fps + h * np.arange(substeps + 1, dtype=np.float64)
            targets, colliders = driver.targets(times[1:]), driver.colliders(times)
            steps: list[FrameElongation] = []
            with np.errstate(all="ignore"):
                for s in range(substeps):
                    x, v = _step(model, system, method.step, float(times[s]), x, v, h, targets[s])
                    moved = x.copy()
                    push_out(
                        moved,
                        x,
                        model.inverse_masses,
                        colliders[s + 1],
                        colliders[s],
                        floor,
                        fabric.thickness,
                        fabric.friction,
                    )
                    x, v = moved, v + (moved - x) / h
                    if record is not None:
                        steps.append(measure_elongation(model, x))
            check_motion(x, v, frame)
        if frame >= 0:
            if record is not None:
                record.start(model, x) if frame == first else record.join(steps, h)
            yield x.copy(), system.energy(x, method.velocity(system, frame / fps, (x, v), h))


def _step(
    model: ClothModel, system: MassSpring, step: Step, time: float, x: Floats, v: Floats, h: float, target: Floats
) -> State:
    """One step with the pinned points on their way to `target` (N, 3)."""
    v = v.copy()
    v[model.pinned] = (target - x[model.pinned]) / h
    x, v = step(system, time, x, v, h)
    x[model.pinned] = target
    return x, v
