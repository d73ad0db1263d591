"""Run of a RigidScene: states of the moving bodies at every step, and figures for the report."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Floats
from anim.errors import UnstableError
from anim.maths import quaternion
from anim.model import Clip, Skeleton
from anim.simulation.rigid_bodies.driver import AnimatedBodies
from anim.simulation.rigid_bodies.impacts import Impact, ImpactFinder
from anim.simulation.rigid_bodies.options import SETTLED_M
from anim.simulation.rigid_bodies.rapier.world import RapierWorld
from anim.simulation.rigid_bodies.rigid_scene import RigidScene
from anim.simulation.steps import Steps

NUM_CONTACT_SAMPLES = 60  # steps of a run at which penetration is measured
MAX_ENERGY_FACTOR = 1e3  # of the energy at the start and of the fall, beyond which a run diverges
SPEED_ENERGY_J_PER_KG = 1.0  # 1.4 m/s: contacts at the start may give this without a fall


@dataclass(frozen=True, slots=True, eq=False)
class RigidMotion:
    """States of M bodies at the steps from 0 s on.

    times: (S,) s. positions (S, M, 3) m, rotations (S, M, 4) in world space. energies: (E, 2) J, kinetic and
    potential, at energy_times (E,) s. penetration: m, the deepest in a sample of steps. overlaps: pairs of bodies that
    overlap at the start. impacts: of each moving body, in order of time. num_rounds: of the clip, until this one.
    """

    times: Floats
    positions: Floats
    rotations: Floats
    energy_times: Floats
    energies: Floats
    penetration: float
    overlaps: list[tuple[int, int, float]]
    impacts: list[list[Impact]]
    num_rounds: int = 1

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


@dataclass(slots=True, eq=False)
class Recorder:
    """States and figures of one round of a run, as far as it has come. num_states: stored so far.

    states: (S, M, 7) relative to `center`, in float32, as Rapier has them. energies: step, kinetic and potential.
    """

    states: NDArray[np.float32]
    step_s: float
    center: Floats
    num_states: int = 0
    energies: list[tuple[int, float, float]] = field(default_factory=list)
    penetration: float = 0.0
    overlaps: list[tuple[int, int, float]] = field(default_factory=list)
    impacts: list[list[Impact]] = field(default_factory=list)
    num_rounds: int = 1

    def motion(self) -> RigidMotion:
        """Return the motion recorded so far."""
        exact = np.asarray(self.states[: self.num_states], np.float64)
        energies = np.array([each[1:] for each in self.energies], np.float64).reshape(-1, 2)
        return RigidMotion(
            np.arange(len(exact), dtype=np.float64) * self.step_s,
            np.asarray(exact[..., :3] + self.center),
            quaternion.normalize(exact[..., 3:]),
            np.array([each[0] for each in self.energies]) * self.step_s,
            energies,
            self.penetration,
            self.overlaps,
            self.impacts,
            self.num_rounds,
        )


def run_scene(
    rigid: RigidScene,
    skeleton: Skeleton,
    clip: Clip,
    steps: Steps,
    *,
    substeps: int,
    finds_impacts: bool = True,
    max_rounds: int = 1,
) -> RigidMotion:
    """Return the motion of a scene; steps before 0 s are not in it.

    clip: the driver, from 0 s on. substeps: steps of a frame. max_rounds: the clip is repeated until the bodies end a
    round as they began it; the motion is that of the last round.
    Raises UnstableError for a run that diverges, with the Recorder as its report.
    """
    world = RapierWorld(rigid, steps.step_s, skeleton.label)
    states = np.empty((steps.num_steps + 1, len(rigid.moving), 7), np.float32)
    recorder = Recorder(states, steps.step_s, world.center)
    run = _Run(rigid, world, AnimatedBodies(skeleton, clip, rigid, steps), recorder, substeps, finds_impacts)
    for index in range(-steps.num_warm_up_steps + 1, 1):
        run.advance(index, 0)
    while True:
        run.begin_round()
        for index in range(1, steps.num_steps + 1):
            run.advance(index, index)
        if recorder.num_rounds >= max_rounds or _seam(states) < SETTLED_M:
            return recorder.motion()
        recorder.num_rounds += 1


class _Run:
    """World of a scene, advanced step by step and recorded."""

    def __init__(
        self,
        rigid: RigidScene,
        world: RapierWorld,
        driver: AnimatedBodies,
        recorder: Recorder,
        substeps: int,
        finds_impacts: bool,
    ) -> None:
        self._rigid = rigid
        self._world = world
        self._driver = driver
        self._recorder = recorder
        self._substeps = substeps
        self._sampled = max(1, len(recorder.states) // NUM_CONTACT_SAMPLES)
        self._finder = ImpactFinder(rigid, world, recorder.step_s) if finds_impacts else None
        self._limit: _EnergyLimit | None = None

    def begin_round(self) -> None:
        """Store the present states as those of 0 s."""
        recorder = self._recorder
        recorder.states[0] = self._world.states()
        recorder.num_states = 1
        recorder.energies, recorder.penetration = [], 0.0
        if self._finder is not None:
            recorder.impacts = self._finder.begin_round()

    def advance(self, index: int, clip_index: int) -> None:
        """Advance to step `index` of this round, with the clip at step `clip_index`."""
        world, recorder = self._world, self._recorder
        driven = self._driver.at(clip_index)
        for i, position, rotation in zip(self._driver.bodies, *driven, strict=True):
            world.move(i, position, rotation)
        world.step()
        if world.has_failed():
            raise _unstable(recorder, index, "a body's state isn't finite")
        if self._limit is None:  # masses are known after the first step, whose contacts are those before it
            self._limit = _EnergyLimit(self._rigid, world)
            recorder.overlaps = [pair for pair in world.contacts() if pair[2] > 0]
        states = world.states()
        if self._finder is not None:
            self._finder.update(index, states, (self._driver.bodies, driven[0] - world.center, driven[1]))
        if index % self._substeps == 0 or index == 1:
            self._check_energy(index)
        if index > 0:
            recorder.states[index] = states
            recorder.num_states = index + 1
            if index % self._sampled == 0:
                recorder.penetration = max([recorder.penetration, *(pair[2] for pair in world.contacts())])

    def _check_energy(self, index: int) -> None:
        """Record the energy; that of step 1 stands for the start, at which Rapier has no masses yet."""
        kinetic, potential = self._world.energy()
        if self._limit is not None and not self._limit.allows(kinetic, potential):
            raise _unstable(self._recorder, index, "the energy grows")
        if index > 0:
            self._recorder.energies.append((0 if index == 1 else index, kinetic, potential))


def _seam(states: NDArray[np.float32]) -> float:
    return float(np.linalg.norm(states[-1, :, :3] - states[0, :, :3], axis=-1).max(initial=0.0))


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


def _unstable(recorder: Recorder, index: int, problem: str) -> UnstableError:
    finer = round(2 / recorder.step_s)
    words = f"the simulation diverges in step {index}: {problem}"
    return UnstableError(words, help=f"a smaller `step`: 1/{finer}").with_report(recorder)
