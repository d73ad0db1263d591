"""What every skinning method gives: matrices packed for its kernel, and the kernel's call."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from anim.arrays import Floats
from anim.skinning.kernels import LANES
from anim.skinning.rig import Singles


@dataclass(frozen=True, slots=True)
class Shape:
    """Vertices in mesh space for up to LANES frames, frames innermost, float32.

    points: (V, 3, m) m, m = 1 where no frame differs, else LANES. normals: the same, or (0, 3, 1) where not wanted.
    """

    points: Singles
    normals: Singles


@dataclass(frozen=True, slots=True)
class Target:
    """Where the results of n frames go: columns `at` … `at` + V of positions (n, all, 3), normals or (0, 0, 3)."""

    at: int
    positions: Singles
    normals: Singles


class Skinner(Protocol):
    """One method on one rig."""

    def pack(self, matrices: Floats) -> Any:
        """Return what the kernel reads of the joints' matrices (n, J, 3, 4), world_from_mesh."""

    def place(self, packed: Any, shape: Shape, target: Target, first: int, last: int) -> None:
        """Write vertices first … last of all n frames into the target."""


NO_NORMALS: Singles = np.empty((0, 0, 3), np.float32)


def lanes(values: Floats) -> Singles:
    """Return (n, J, ...) as float32 (J, C, LANES): a row of frames per joint and number, the last frame filling up."""
    frames, joints = values.shape[:2]
    return filled(values.reshape(frames, joints, -1).transpose(1, 2, 0))


def filled(values: Floats) -> Singles:
    """Return (..., n) as float32 (..., LANES), the last of the n filling up."""
    frames = values.shape[-1]
    rows: Singles = np.empty((*values.shape[:-1], LANES), np.float32)
    rows[..., :frames] = values
    rows[..., frames:] = rows[..., frames - 1 : frames]
    return rows
