"""Interface of skinning methods: packing of matrices for a kernel, and its call."""

from __future__ import annotations

from typing import Any, Protocol

from anim.arrays import Floats
from anim.skinning.kernels.layout import LANES, FloatArray, OutputSlice, VertexBlock, aligned


class Skinner(Protocol):
    """One method on one rig."""

    def pack(self, matrices: Floats) -> Any:
        """Return the joints' matrices (n, J, 3, 4), world_from_mesh, in the kernel's layout."""

    def skin(self, packed: Any, shape: VertexBlock, target: OutputSlice, first: int, last: int) -> None:
        """Write vertices first … last of all n frames into the target."""


def lanes(values: Floats) -> FloatArray:
    """Return (n, J, ...) as float32 (J, C, LANES): a row of frames per joint and component.

    The last frame is repeated as padding.
    """
    frames, joints = values.shape[:2]
    return fill_lanes(values.reshape(frames, joints, -1).transpose(1, 2, 0))


def fill_lanes(values: Floats) -> FloatArray:
    """Return (..., n) as float32 (..., LANES), padded with the last of the n."""
    frames = values.shape[-1]
    rows = aligned(*values.shape[:-1], LANES)
    rows[..., :frames] = values
    rows[..., frames:] = rows[..., frames - 1 : frames]
    return rows
