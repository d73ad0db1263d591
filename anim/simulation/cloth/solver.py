"""Frames of a cloth by XPBD."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.errors import RangeError, UnstableError
from anim.simulation.cloth.driver import ClothDriver
from anim.simulation.cloth.model import ClothModel, Fabric

NO_FLOOR_M = -1e30
AIR_KG_M3 = 1.2
MAX_SPEED_M_S = 1e4
GUST_RATES_HZ = (0.31, 0.73, 1.37, 2.9)


@dataclass(frozen=True, slots=True)
class Environment:
    """Forces on a cloth: gravity (3,) m/s², wind (3,) m/s, gusts as a fraction of its speed, floor m or None.

    air: kg/m³. seed: of the gusts.
    """

    gravity: tuple[float, float, float] = (0.0, -9.81, 0.0)
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gusts: float = 0.3
    air: float = AIR_KG_M3
    floor: float | None = None
    seed: int = 0

    def wind_at(self, times: Floats) -> Floats:
        """Return the wind (S, 3) m/s at times (S,) s: its mean, and sines in all directions as gusts."""
        speed = float(np.linalg.norm(self.wind))
        random = np.random.default_rng([self.seed, 7])
        phases, parts = (
            random.uniform(0, 2 * np.pi, (len(GUST_RATES_HZ), 3)),
            random.uniform(0.5, 1, (len(GUST_RATES_HZ), 3)),
        )
        angles = 2 * np.pi * np.asarray(GUST_RATES_HZ)[:, None] * times[:, None, None] + phases
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
    iterations: int = 1,
    tethers: bool = True,
) -> Iterator[Floats]:
    """Yield the points (P, 3) m at frames 0 … num_frames − 1 of `fps` per second.

    substeps: per frame. warm_up_frames: simulated before, at the pose of 0 s. iterations: of the constraints in each
    substep. Raises UnstableError.
    """
    from anim.simulation.cloth.kernels.xpbd import step_frame

    if substeps < 1 or iterations < 1:
        raise RangeError(f"{substeps} substeps and {iterations} iterations (expected at least 1)")
    h = 1.0 / (fps * substeps)
    topology = model.topology
    first = -warm_up_frames
    p = driver.all_vertices(first / fps)[topology.first_vertex]
    v = np.zeros_like(p)
    anchors = model.anchors if tethers else np.full(len(p), -1)
    numbers = np.array(
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
    for frame in range(first, num_frames):
        if frame > first:
            times = (frame - 1) / fps + h * np.arange(substeps + 1, dtype=np.float64)
            step_frame(
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
                model.tethers,
                topology.faces,
                driver.colliders(times),
                environment.wind_at(times[1:]),
                model.rest,
                numbers,
                iterations,
            )
            _check(p, v, frame)
        if frame >= 0:
            yield p.copy()


def _check(p: Floats, v: Floats, frame: int) -> None:
    speed = float(np.abs(v).max(initial=0.0))
    if not (np.isfinite(p).all() and speed < MAX_SPEED_M_S):
        raise UnstableError(f"the simulation diverges at frame {frame}", help="raise the substeps, or the compliance")
