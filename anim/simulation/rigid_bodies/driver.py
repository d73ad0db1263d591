"""Frames of animated bodies at every step, from the driving clip."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats
from anim.maths import matrix
from anim.model import Clip, Skeleton
from anim.sampling.pose import PoseSampler
from anim.sampling.world import world_matrices

CHUNK_STEPS = 256  # poses of all nodes are in memory for this many


class AnimatedBodies:
    """Positions and rotations of some nodes while the clip plays; before 0 s it has the pose of 0 s."""

    def __init__(self, skeleton: Skeleton, clip: Clip, nodes: Sequence[int], step: float, first: int) -> None:
        """first: index of the first step, ≤ 0; step n is at n · `step` seconds."""
        self._skeleton = skeleton
        self._sampler = PoseSampler(skeleton, clip)
        self._nodes = list(nodes)
        self._step = step
        self._begin = self._end = first
        self._positions = self._rotations = np.empty((0, 0, 0))

    def at(self, index: int) -> tuple[Floats, Floats]:
        """Return positions (n, 3) and rotations (n, 4) of the nodes at a step; steps are asked for in order."""
        if index >= self._end:
            self._begin, self._end = index, index + CHUNK_STEPS
            times = np.maximum(np.arange(self._begin, self._end) * self._step, 0.0)
            world = world_matrices(self._skeleton, self._sampler.at(times))[:, self._nodes]
            self._positions, self._rotations, _, _ = matrix.decompose(world)
        return self._positions[index - self._begin], self._rotations[index - self._begin]
