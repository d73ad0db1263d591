"""Frames of a cloth by XPBD."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.errors import RangeError
from anim.simulation.cloth.divergence import check_lengths, check_motion, longest_per_rest
from anim.simulation.cloth.driver import ClothDriver
from anim.simulation.cloth.elongation import ElongationRecord
from anim.simulation.cloth.model import ClothModel, Fabric
from anim.simulation.limits import (
    MAX_ACCELERATION_M_S2,
    MAX_COEFFICIENT,
    MAX_DENSITY,
    MAX_LENGTH_M,
    MAX_SPEED_M_S,
    check_largest,
    check_range,
)

NO_FLOOR_M = -1e30
AIR_KG_M3 = 1.2
GUST_RATES_HZ = (0.31, 0.73, 1.37, 2.9)
STIFF_SWEEPS = 1  # of the constraints per substep, after those of the hierarchy
SOFT_SWEEPS = 4  # of a fabric that is longer under its weight than distant pairs allow: those then do nothing
MAX_ELONGATION = 0.01  # of edges, beyond the fabric's own elongation
LIMIT_SWEEPS = 3  # at most, per substep; most find nothing to do
SLACK = 1e-4  # of tethers and of distant pairs: they bound a fabric's length, whatever the step
PEAK_LOAD = 4.0  # largest tension, of the weight: 3 at the bottom of a swing from the horizontal


@dataclass(frozen=True, slots=True)
class Environment:
    """Forces on a cloth: gravity (3,) m/s², wind (3,) m/s, gusts as a fraction of its speed, floor m or None.

    air: kg/m³. seed: of the gusts. period: s, after which they repeat; None for no period. Raises RangeError.
    """

    gravity: tuple[float, float, float] = (0.0, -9.81, 0.0)
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gusts: float = 0.3
    air: float = AIR_KG_M3
    floor: float | None = None
    seed: int = 0
    period: float | None = None

    def __post_init__(self) -> None:
        check_largest("gravity", self.gravity, MAX_ACCELERATION_M_S2, "m/s²")
        check_largest("wind", self.wind, MAX_SPEED_M_S, "m/s")
        check_range("gusts", self.gusts, 0.0, MAX_COEFFICIENT)
        check_range("air", self.air, 0.0, MAX_DENSITY, "kg/m³")
        if self.floor is not None:
            check_largest("floor", (self.floor,), MAX_LENGTH_M, "m")

    def wind_at(self, times: Floats) -> Floats:
        """Return the wind (S, 3) m/s at times (S,) s: its mean, and sines in all directions as gusts."""
        speed = float(np.linalg.norm(self.wind))
        random = np.random.default_rng([self.seed, 7])
        phases, parts = (
            random.uniform(0, 2 * np.pi, (len(GUST_RATES_HZ), 3)),
            random.uniform(0.5, 1, (len(GUST_RATES_HZ), 3)),
        )
        rates = np.asarray(GUST_RATES_HZ)
        if self.period is not None:
            rates = np.maximum(np.round(rates * self.period), 1) / self.period
        angles = 2 * np.pi * rates[:, None] * times[:, None, None] + phases
        gusts = (parts * np.sin(angles)).mean(axis=1)
        return np.asarray(np.asarray(self.wind) + self.gusts * speed * gusts)


def run_xpbd(
    model: ClothModel,
    fabric: Fabric,
    environment: Environment,
    driver: ClothDriver,
    *,
    fps: float,
    num_frames: int,
    substeps: int,
    warm_up_frames: int = 0,
    iterations: int | None = None,
    tethers: bool = True,
    max_elongation: float | None = MAX_ELONGATION,
    start: Floats | None = None,
    record: ElongationRecord | None = None,
) -> Iterator[tuple[Floats, float]]:
    """Yield the points (P, 3) m and the energy in J at frames 0 … num_frames − 1 of `fps` per second.

    substeps: per frame. warm_up_frames: simulated before, at the pose of 0 s. iterations: of the constraints in each
    substep, None for as many as the fabric needs. max_elongation: limit of the edges' elongation beyond the fabric's
    own; None for none, and for no limits between distant points. The energy is kinetic, elastic by the compliances,
    and potential. start: (P, 3) m; the mesh at its pose without it. record: gets the elongation at all steps of each
    frame. Raises UnstableError.
    """
    from anim.simulation.cloth.kernels.xpbd import step_frame

    own = _elastic_elongation(model, fabric, environment)
    if iterations is None:
        iterations = SOFT_SWEEPS if own > SLACK else STIFF_SWEEPS
    if substeps < 1 or iterations < 1:
        raise RangeError(f"{substeps} substeps and {iterations} iterations (expected at least 1)")
    h = 1.0 / (fps * substeps)
    topology = model.topology
    first = -warm_up_frames
    p = driver.all_vertices(first / fps)[topology.first_vertex] if start is None else start.copy()
    v = np.zeros_like(p)
    masses = model.masses
    elastic = 0.0
    anchors = model.anchors if tethers else np.full((len(p), 1), -1)
    distances, tether_lengths = (1 + SLACK + own) * model.hierarchy.lengths, (1 + SLACK + own) * model.tethers
    levels = model.hierarchy.starts if max_elongation is not None else np.zeros(1, np.int64)
    longest, elongation = np.zeros((substeps, 2), np.int64), np.zeros((substeps, 2))
    outward = np.ascontiguousarray(topology.edges[model.outward])
    most = (1 + (max_elongation or 0.0)) * model.edge_lengths[model.outward]
    numbers = _numbers(h, model, fabric, environment)
    for frame in range(first, num_frames):
        if frame > first:
            times = (frame - 1) / fps + h * np.arange(substeps + 1, dtype=np.float64)
            elastic = step_frame(
                p,
                v,
                model.inverse_masses,
                model.pinned,
                driver.targets(times[1:]),
                topology.edges,
                model.edge_lengths,
                topology.hinges,
                model.hinge_lengths,
                anchors,
                tether_lengths,
                model.hierarchy.pairs[: levels[-1]],
                distances[: levels[-1]],
                levels,
                outward,
                most,
                model.outward,
                topology.faces,
                driver.colliders(times),
                environment.wind_at(times[1:]),
                model.rest,
                numbers,
                iterations,
                0 if max_elongation is None else LIMIT_SWEEPS,
                longest,
                elongation,
            )
            check_motion(p, v, frame)
            if max_elongation is not None and 1 + elongation[-1].max() > longest_per_rest(own):  # few frames
                check_lengths(model, p, own, frame)
        if frame >= 0 and record is not None:
            record.add(longest, elongation, h) if frame > first else record.start(model, p)
        if frame >= 0:
            yield p.copy(), elastic + _energy(masses, environment, p, v)


def _numbers(h: float, model: ClothModel, fabric: Fabric, environment: Environment) -> Floats:
    """The numbers of `step_frame`, in its order."""
    return np.array(
        [
            h,
            *environment.gravity,
            fabric.stretch_compliance,
            fabric.bend_compliance,
            fabric.damping,
            environment.air if any(environment.wind) or environment.air != AIR_KG_M3 else 0.0,
            NO_FLOOR_M if environment.floor is None else environment.floor,
            fabric.thickness,
            fabric.friction,
            model.self_collision,
        ]
    )


def _elastic_elongation(model: ClothModel, fabric: Fabric, environment: Environment) -> float:
    """Elongation of the edges at the pinned points under the largest load, by the fabric's own compliance."""
    weight = float(model.masses.sum()) * float(np.linalg.norm(environment.gravity))
    holding = max(len(np.unique(model.anchors[:, 0])), 1)
    return PEAK_LOAD * fabric.stretch_compliance * weight / (holding * float(model.edge_lengths.mean()))


def _energy(masses: Floats, environment: Environment, p: Floats, v: Floats) -> float:
    """Kinetic and potential energy in J of masses (P,), 0 for pinned points; the potential is 0 at the origin.

    Without `@`, whose threads keep a core busy for milliseconds after each product of over 10 000 numbers.
    """
    squares, potentials = np.einsum("pc,pc->p", v, v), np.einsum("pc,c->p", p, np.asarray(environment.gravity))
    return float((masses * (0.5 * squares - potentials)).sum())
