"""Linear interpolation between the results of two methods."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from anim.arrays import Floats
from anim.skinning.kernels.layout import FloatArray, OutputSlice, VertexBlock
from anim.skinning.methods.skinner import Skinner


@dataclass(frozen=True)
class BlendedMethod:
    """Positions (1 − fraction) · first + fraction · second; normals and tangents the same, normalized."""

    first: Skinner
    second: Skinner
    fraction: float

    def pack(self, matrices: Floats) -> tuple[Any, Any]:
        """Return the packed matrices of both methods."""
        return self.first.pack(matrices), self.second.pack(matrices)

    def skin(self, packed: tuple[Any, Any], shape: VertexBlock, target: OutputSlice, first: int, last: int) -> None:
        """Write vertices first … last of all frames."""
        self.first.skin(packed[0], shape, target, first, last)
        other_output = OutputSlice(target.at, *(np.empty_like(each) for each in target[1:]))
        self.second.skin(packed[1], shape, other_output, first, last)
        span = slice(target.at + first, target.at + last)
        _mix(target.positions[:, span], other_output.positions[:, span], self.fraction)
        for ours, other in ((target.normals, other_output.normals), (target.tangents, other_output.tangents)):
            if len(ours):
                _mix(ours[:, span], other[:, span], self.fraction)
                length = np.sqrt((ours[:, span] ** 2).sum(axis=-1, keepdims=True))
                ours[:, span] /= np.where(length > 0, length, 1)


def _mix(into: FloatArray, other: FloatArray, fraction: float) -> None:
    into *= np.float32(1 - fraction)
    into += np.float32(fraction) * other
