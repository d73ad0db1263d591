"""Matrices of nodes at every step of a simulation, from the driving clip."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats
from anim.maths import matrix, quaternion
from anim.model import Clip, Skeleton
from anim.sampling import PoseSampler, world_matrices

CHUNK_STEPS, CHUNK_MATRICES = 256, 1 << 18  # poses of all nodes are in memory for this many, or fewer of many nodes


class NodeMotion:
    """Motion of nodes; before its start the clip has the pose of its start, or repeats with a period."""

    def __init__(self, skeleton: Skeleton, clip: Clip, start: float = 0.0, period: float | None = None) -> None:
        """start: s of the clip, at 0 s of the simulation. period: s of a loop."""
        self._skeleton, self._sampler = skeleton, PoseSampler(skeleton, clip)
        self._start, self._period = start, period

    def at(self, times: Floats, nodes: Sequence[int]) -> Floats:
        """Return the world matrices (S, n, 3, 4) at times (S,) s."""
        matrices = np.empty((len(times), len(nodes), 3, 4))
        wrapped = np.maximum(times, 0.0) if self._period is None else _wrap(times, self._period)
        num_steps = min(CHUNK_STEPS, max(1, CHUNK_MATRICES // max(len(self._skeleton), 1)))
        for first in range(0, len(times), num_steps):
            chunk = slice(first, first + num_steps)
            poses = self._sampler.at(self._start + wrapped[chunk])
            matrices[chunk] = world_matrices(self._skeleton, poses)[:, list(nodes)]
        return matrices


def split_frames(matrices: Floats) -> tuple[Floats, Floats]:
    """Return positions (S, n, 3) m and rotations (S, n, 4), sign-continuous, of matrices (S, n, 3, 4)."""
    positions, rotations, _, _ = matrix.decompose(matrices)
    return positions, quaternion.align_signs(rotations)


def _wrap(times: Floats, period: float) -> Floats:
    """Times in 0 … period; those from 0 on stay."""
    return np.asarray(np.where(times < 0, times - np.floor(times / period) * period, times))
