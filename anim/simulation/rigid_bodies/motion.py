"""Run of a RigidScene: states of the moving bodies at every step, and figures for the report."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.errors import UnstableError
from anim.maths import quaternion
from anim.model import Clip, Skeleton
from anim.simulation.rigid_bodies.driver import AnimatedBodies
from anim.simulation.rigid_bodies.impacts import Impact, ImpactFinder
from anim.simulation.rigid_bodies.rapier_world import RapierWorld
from anim.simulation.rigid_bodies.rigid_scene import RigidScene
from anim.simulation.steps import Steps

NUM_CONTACT_SAMPLES = 60  # steps of a run at which penetration is measured
MAX_ENERGY_FACTOR = 1e3  # of the energy at the start and of the fall, beyond which a run diverges
SPEED_ENERGY_J_PER_KG = 1.0  # 1.4 m/s: contacts at the start may give this without a fall


@dataclass(frozen=True, slots=True, eq=False)
class RigidMotion:
    """States of M bodies at the steps from 0 s on.

    times: (S,) s. positions (S, M, 3) m, rotations (S, M, 4) in world space. energies: (frames, 2) J, kinetic and
    potential. penetration: m, the deepest in a sample of steps. overlaps: pairs of bodies that overlap at the start.
    impacts: of each moving body, in order of time; none in a run with a stride.
    """

    times: Floats
    positions: Floats
    rotations: Floats
    energies: Floats
    penetration: float
    overlaps: list[tuple[int, int, float]]
    impacts: list[list[Impact]]

    def at(self, body: int, times: Floats) -> tuple[Floats, Floats]:
        """Return positions (K, 3) and rotations (K, 4) of a body at times (K,), linear between steps."""
        if len(self.times) == 1:
            return self.positions[np.zeros(len(times), int), body], self.rotations[np.zeros(len(times), int), body]
        position = times / self.times[1]
        before = np.clip(np.floor(position + 1e-9).astype(np.int64), 0, len(self.times) - 2)
        u = np.clip(position - before, 0.0, 1.0)[:, None]
        u[np.abs(u - np.round(u)) < 1e-9] = np.round(u[np.abs(u - np.round(u)) < 1e-9])
        points = (1 - u) * self.positions[before, body] + u * self.positions[before + 1, body]
        a, b = self.rotations[before, body], self.rotations[before + 1, body]
        return points, quaternion.nlerp(a, b, u[:, 0])


def run_scene(
    rigid: RigidScene, skeleton: Skeleton, clip: Clip, steps: Steps, *, substeps: int, stride: int = 1
) -> RigidMotion:
    """Return the motion of a scene; steps before 0 s are not in it.

    substeps: steps of a frame. stride: keep every so many steps; penetration is measured with 1.
    Raises UnstableError for a run that diverges.
    """
    world = RapierWorld(rigid, steps.step_s)
    first = -steps.num_warm_up_steps
    animated = rigid.animated
    driver = AnimatedBodies(skeleton, clip, [rigid.bodies[i].node for i in animated], steps.step_s, first)
    count = steps.num_steps // stride + 1
    states = np.empty((count, len(rigid.moving), 7), np.float32)  # what Rapier has
    energies: list[tuple[float, float]] = []
    overlaps: list[tuple[int, int, float]] = []
    finder = ImpactFinder(rigid, world, steps.step_s) if stride == 1 else None
    limit: _EnergyLimit | None = None
    penetration, sampled = 0.0, max(1, steps.num_steps // NUM_CONTACT_SAMPLES)
    for index in range(first, steps.num_steps + 1):
        if index > first:
            driven = driver.at(index) if animated else None
            if driven is not None:
                for i, position, rotation in zip(animated, *driven, strict=True):
                    world.move(i, position, rotation)
            world.step()
            if world.has_failed():
                raise _unstable(index, steps.step_s, "a body's state isn't finite")
            if limit is None:  # masses are known after the first step, whose contacts are those before it
                limit, overlaps = _EnergyLimit(rigid, world), [pair for pair in world.contacts() if pair[2] > 0]
            if finder is not None:
                row = np.array(world.states())
                finder.update(index, row, driven and (animated, driven[0] - world.center, driven[1]))
        if index >= 0 and index % stride == 0:
            states[index // stride] = row if finder is not None and index > first else world.states()
        is_start = index == max(first, 0) + 1  # stands for the start, at which Rapier has no masses yet
        if (index % substeps == 0 and index > max(first, 0)) or is_start:
            energy = world.energy()
            if limit is not None and not limit.allows(*energy):
                raise _unstable(index, steps.step_s, "the energy grows")
            energies += [energy] * (index >= 0)
        if index > 0 and index % sampled == 0 and stride == 1:
            penetration = max([penetration, *(depth for _, _, depth in world.contacts())])
    times = np.asarray(np.arange(count) * (steps.step_s * stride), np.float64)
    exact = np.asarray(states, np.float64)
    positions = np.asarray(exact[..., :3] + world.center, np.float64)
    rotations = quaternion.normalize(exact[..., 3:])
    figures: Floats = np.array(energies, np.float64).reshape(-1, 2)
    impacts = [] if finder is None else finder.found
    return RigidMotion(times, positions, rotations, figures, penetration, overlaps, impacts)


class _EnergyLimit:
    """Bound of the kinetic energy by that of the start and of the fall; none where a clip or a drive does work."""

    def __init__(self, rigid: RigidScene, world: RapierWorld) -> None:
        self._is_bounded = not rigid.animated and not any(joint.drives for joint in rigid.joints)
        self._kinetic, self._potential = world.energy()
        self._spare = SPEED_ENERGY_J_PER_KG * world.mass()

    def allows(self, kinetic: float, potential: float) -> bool:
        if not np.isfinite(kinetic):
            return False
        available = self._kinetic + max(self._potential - potential, 0.0) + self._spare
        return not self._is_bounded or kinetic <= MAX_ENERGY_FACTOR * available


def _unstable(index: int, step: float, problem: str) -> UnstableError:
    finer = round(2 / step)
    return UnstableError(f"the simulation diverges in step {index}: {problem}", help=f"a smaller `step`: 1/{finer}")
