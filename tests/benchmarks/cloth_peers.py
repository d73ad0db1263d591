"""The same cloth by Rapier (extra `physics`) and MuJoCo (`pip install mujoco`), where they are installed.

A square of 1 m², 200 g and n × n points, level at the start and held at an edge, for 300 frames at 60 per second.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from anim.arrays import Floats, Ints

FPS, FRAMES, MASS_KG = 60, 300, 0.2
RAPIER_SOFTNESS = (1e5, 1.0)  # Hz and damping ratio: least elongation over the run of its default, 1e4 and 1e5 Hz
MUJOCO_STEP_S = 1 / 240  # the only setup that was tried, with 10 iterations: not its best
Step = Callable[[], Floats]

MUJOCO = """<mujoco><option timestep="{step}" solver="CG" integrator="implicitfast" iterations="10"/>
<size memory="800M"/><worldbody><flexcomp name="cloth" type="grid" count="{n} {n} 1" spacing="{gap} {gap} {gap}" dim="2"
mass="{mass}" radius="0.001" pos="0 0 1"><edge equality="true"/>
<contact contype="0" conaffinity="0" selfcollide="none"/>
<pin gridrange="0 0 0 {last}"/></flexcomp></worldbody></mujoco>"""


def run_peers(n: int) -> Iterator[tuple[str, float, float]]:
    """Yield the name, seconds of CPU and worst elongation over the run of each peer that is installed."""
    for name, start in (("rapier3d", _rapier), ("mujoco", _mujoco)):
        try:
            package = importlib.import_module(name)
        except ImportError:
            continue
        step = start(package, n)
        began = time.process_time()
        worst = max(_elongation(step(), n) for _ in range(FRAMES))
        yield f"{name} {getattr(package, '__version__', '')}", time.process_time() - began, worst


def _rapier(rapier: Any, n: int) -> Step:
    world = rapier.PhysicsWorld(gravity=(0, -9.81, 0))
    world.integration_parameters.dt, world.integration_parameters.num_solver_iterations = 1 / FPS, 10
    gap = 1 / (n - 1)
    cloth = rapier.SoftBody.cloth((0, 1, 0), (gap, 0, 0), (0, 0, gap), n, n).mass(MASS_KG).softness(RAPIER_SOFTNESS)
    handle = world.add_soft_body(cloth.pinned_particles(list(range(n))).no_surface_collider())

    def step() -> Floats:
        world.step()
        return np.array(world.soft_bodies[handle].particle_positions)

    return step


def _mujoco(mujoco: Any, n: int) -> Step:
    text = MUJOCO.format(n=n, gap=1 / (n - 1), last=n - 1, step=MUJOCO_STEP_S, mass=MASS_KG)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)

    def step() -> Floats:
        for _ in range(round(1 / FPS / MUJOCO_STEP_S)):
            mujoco.mj_step(model, data)
        return np.array(data.flexvert_xpos)

    return step


def _elongation(x: Floats, n: int) -> float:
    """Largest relative elongation of the edges along rows and columns, but for the edge that is held."""
    grid = x.reshape(n, n, 3)
    lengths = [np.linalg.norm(np.diff(grid, axis=axis), axis=2) * (n - 1) for axis in (0, 1)]
    return float(max(lengths[0].max(), lengths[1][1:].max()) - 1)


def grid_faces(n: int) -> Ints:
    """Return the faces (T, 3) of n × n points in rows."""
    at = np.arange(n * n).reshape(n, n)
    a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel()
    return np.concatenate([np.stack([a, c, b], 1), np.stack([b, c, d], 1)])
