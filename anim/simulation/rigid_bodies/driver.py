"""Frames of animated bodies at every step, from the driving clip."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.maths import matrix
from anim.model import Clip, Skeleton
from anim.sampling.pose import PoseSampler
from anim.sampling.world import world_matrices
from anim.simulation.rigid_bodies.distances import check_animated
from anim.simulation.rigid_bodies.rigid_scene import RigidScene
from anim.simulation.steps import Steps

CHUNK_STEPS = 256  # poses of all nodes are in memory for this many


class AnimatedBodies:
    """Positions and rotations of a scene's animated bodies while the clip plays. bodies: their indices."""

    def __init__(self, skeleton: Skeleton, clip: Clip, rigid: RigidScene, steps: Steps) -> None:
        """clip: begins at 0 s; step n is at n steps."""
        self.bodies = rigid.animated
        self._skeleton = skeleton
        self._rigid = rigid
        self._sampler = PoseSampler(skeleton, clip)
        self._nodes = [rigid.bodies[i].node for i in self.bodies]
        self._step = steps.step_s
        self._begin = self._end = 0
        self._positions, self._rotations = np.empty((1, 0, 3)), np.empty((1, 0, 4))

    def at(self, index: int) -> tuple[Floats, Floats]:
        """Return positions (n, 3) and rotations (n, 4) of the bodies at a step.

        Raises UnsupportedError for a body too far away to be simulated.
        """
        if not self._nodes:
            return self._positions[0], self._rotations[0]
        if not self._begin <= index < self._end:
            self._begin, self._end = index, index + CHUNK_STEPS
            times = np.arange(self._begin, self._end, dtype=np.float64) * self._step
            world = world_matrices(self._skeleton, self._sampler.at(times))[:, self._nodes]
            self._positions, self._rotations, _, _ = matrix.decompose(world)
            check_animated(self._positions, self._rigid, self._skeleton)
        return self._positions[index - self._begin], self._rotations[index - self._begin]
