"""Two methods on one rig, their results mixed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from anim.arrays import Floats
from anim.skinning.kernels.layout import FloatArray, OutputSlice, VertexBlock
from anim.skinning.methods.skinner import Skinner


@dataclass(frozen=True)
class BlendedMethod:
    """Positions (1 − share) · first + share · second; normals and tangents the same, made unit again."""

    first: Skinner
    second: Skinner
    fraction: float

    def pack(self, matrices: Floats) -> tuple[Any, Any]:
        """Return what both kernels read."""
        return self.first.pack(matrices), self.second.pack(matrices)

    def skin(self, packed: tuple[Any, Any], shape: VertexBlock, target: OutputSlice, first: int, last: int) -> None:
        """Write vertices first … last of all frames."""
        self.first.skin(packed[0], shape, target, first, last)
        aside = OutputSlice(target.at, *(np.empty_like(each) for each in target[1:]))
        self.second.skin(packed[1], shape, aside, first, last)
        span = slice(target.at + first, target.at + last)
        _mix(target.positions[:, span], aside.positions[:, span], self.fraction)
        for ours, other in ((target.normals, aside.normals), (target.tangents, aside.tangents)):
            if len(ours):
                _mix(ours[:, span], other[:, span], self.fraction)
                length = np.sqrt((ours[:, span] ** 2).sum(axis=-1, keepdims=True))
                ours[:, span] /= np.where(length > 0, length, 1)


def _mix(into: FloatArray, other: FloatArray, share: float) -> None:
    into *= np.float32(1 - share)
    into += np.float32(share) * other
