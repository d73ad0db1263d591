"""Step loop of spring bones: the driver first, then level by level all joints side by side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, Ints
from anim.errors import UnstableError
from anim.maths import matrix
from anim.model import Clip, Skeleton
from anim.model.skeleton import nearest_ancestors, node_mask
from anim.simulation.spring_bones.batch import Batch
from anim.simulation.spring_bones.chains import SpringBones
from anim.simulation.spring_bones.driver import Driver, DriverChunk
from anim.simulation.spring_bones.plan import Level, Plan, make_plan

CHUNK_STEPS = 256  # driver steps evaluated together; more needs more memory and hardly saves time


@dataclass(frozen=True, slots=True)
class SpringMotion:
    """Motion of J joints, in the order of the chains, at S steps.

    rotations: (S, J, 4) local. tails: (S, J, 3) in world space, in metres. elongation: (S, J) relative, and
    energies: (S, J) J of 1 kg, both 0 for joints whose bones keep their lengths.
    """

    rotations: Floats
    tails: Floats
    elongation: Floats
    energies: Floats


class SpringSolver:
    """Simulation of checked chains, driven by a clip.

    step: seconds, > 0. integrator: of joints with a frequency, as masses on springs; "" solves them exactly.
    Every call of `run` continues from the state that the last one left.
    """

    def __init__(
        self, skeleton: Skeleton, clip: Clip, bones: SpringBones, *, step: float, integrator: str = ""
    ) -> None:
        self._plan = make_plan(skeleton, bones)
        self._driver = Driver(skeleton, clip, frozenset(bones.nodes), self._plan.driven)
        self._levels = [
            _LevelSolver(skeleton, bones, level, self._plan, step, integrator) for level in self._plan.levels
        ]
        self._num_joints = len(bones.nodes)
        self._bases = _base_rows(skeleton, bones, self._plan)
        self._centers = _driven_centers(bones, self._plan)
        self._world = np.zeros((self._plan.num_rows, 3, 4))
        self._world[-1] = np.eye(3, 4)  # of the scene

    def start(self, time: float) -> None:
        """Set all joints to rest, without velocity, in the driver's pose at `time` seconds."""
        chunk = self._load(np.array([time]))
        self._world[: len(self._plan.driven)] = chunk.world[0]
        for level in self._levels:
            level.start(self._world)

    def warm_up(self, time: float, num_steps: int) -> None:
        """Advance by steps in the driver's pose at `time` seconds, without recording them. Raises UnstableError."""
        for first in range(0, num_steps, CHUNK_STEPS):
            self.run(np.full(min(CHUNK_STEPS, num_steps - first), time), num_before=first)

    def run(self, times: Floats, *, num_before: int = 0) -> SpringMotion:
        """Advance by one step to each of the times (S,), and return the motion.

        num_before: steps done before, which count in the report of an error.
        Raises UnstableError at the first value that is not finite.
        """
        size = (len(times), self._num_joints)
        motion = SpringMotion(np.empty((*size, 4)), np.empty((*size, 3)), np.zeros(size), np.zeros(size))
        driven = len(self._plan.driven)
        for first in range(0, len(times), CHUNK_STEPS):
            part = times[first : first + CHUNK_STEPS]
            chunk = self._load(part)
            with np.errstate(over="ignore", invalid="ignore"):
                for frame in range(len(part)):
                    self._world[:driven] = chunk.world[frame]
                    for level in self._levels:
                        level.advance(self._world, frame, motion, first + frame)
            _check_finite(motion, times, first, first + len(part), num_before)
        return motion

    def jump(self, before: float, after: float) -> None:
        """Carry the state along as the driver jumps from one time to another, seconds.

        Tails move rigidly with the node that their chain is attached to: a driver that ends elsewhere than it starts,
        as with root motion, does not shake them.
        """
        ends = self._driver.at(np.array([before, after])).world
        scene = np.eye(3, 4)[None]
        world_before, world_after = (np.concatenate((each, scene)) for each in ends)
        moved = matrix.multiply(world_after[self._bases], matrix.inverse(world_before[self._bases]))
        own = self._centers < -1  # centers that a spring moves: their state is relative to them
        moved[own] = np.eye(3, 4)
        rows = np.where(own, -1, self._centers)
        for level in self._levels:
            level.transform(moved, world_before[rows], world_after[rows])

    def _load(self, times: Floats) -> DriverChunk:
        chunk = self._driver.at(times)
        for level in self._levels:
            level.load(chunk)
        return chunk


class _LevelSolver:
    """Batches and followers of one level."""

    def __init__(
        self, skeleton: Skeleton, bones: SpringBones, level: Level, plan: Plan, step: float, integrator: str
    ) -> None:
        self._batches = [Batch(skeleton, batch, bones.colliders, plan, step, integrator) for batch in level.batches]
        self._followers = np.array(level.followers, np.int64)
        self._rows = plan.rows[self._followers]
        self._parents = plan.rows[skeleton.parents[self._followers]]

    def load(self, chunk: DriverChunk) -> None:
        self._local = np.swapaxes(chunk.local[self._followers], 0, 1)
        for batch in self._batches:
            batch.load(chunk)

    def start(self, world: Floats) -> None:
        self._follow(world, 0)
        for batch in self._batches:
            batch.start(world)

    def advance(self, world: Floats, frame: int, motion: SpringMotion, at: int) -> None:
        self._follow(world, frame)
        for batch in self._batches:
            motion.rotations[at, batch.indices] = batch.advance(world, frame)
            motion.tails[at, batch.indices] = batch.tails
            found = batch.figures()
            if found is not None:
                motion.elongation[at, batch.indices], motion.energies[at, batch.indices] = found

    def transform(self, moved: Floats, before: Floats, after: Floats) -> None:
        for batch in self._batches:
            at = batch.indices
            batch.transform(moved[at], before[at], after[at])

    def _follow(self, world: Floats, frame: int) -> None:
        if len(self._followers):
            world[self._rows] = matrix.multiply(world[self._parents], self._local[frame])


def _base_rows(skeleton: Skeleton, bones: SpringBones, plan: Plan) -> Ints:
    """The row (J,) of each joint's nearest ancestor that no spring moves; −1, the scene, if there is none."""
    bases = nearest_ancestors(skeleton.parents, node_mask(skeleton, plan.driven))[list(bones.nodes)]
    return np.where(bases >= 0, plan.rows[bases], -1)


def _driven_centers(bones: SpringBones, plan: Plan) -> Ints:
    """The row (J,) of each joint's center; −1 for the scene, −2 for a center that a spring moves."""
    centers = [chain.center for chain in bones.chains for _ in chain.joints]
    rows = [-1 if each is None else int(plan.rows[each]) for each in centers]
    return np.array([row if row < len(plan.driven) else -2 for row in rows], np.int64)


def _check_finite(motion: SpringMotion, times: Floats, first: int, end: int, num_before: int) -> None:
    wrong = ~np.isfinite(motion.rotations[first:end]).all(axis=(1, 2))
    if wrong.any():
        raise UnstableError(
            f"the springs diverge at {times[first + int(wrong.argmax())]:.4g} s: numbers are too large",
            help="smaller `stiffness` and `gravity`, or `frequency` and `damping_ratio`, which are always stable",
        ).with_report(num_before + first + int(wrong.argmax()))
