"""Dual-quaternion skinning: twisted limbs keep their volume."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from anim.arrays import Floats
from anim.maths import dual_quaternion as duals
from anim.skinning.compiled import compiled
from anim.skinning.kernels.around_duals import around_duals
from anim.skinning.kernels.lanes import LANES, Held, Shape, Singles, Target, room
from anim.skinning.rig import Rig, whole_weights
from anim.skinning.skinner import lanes
from anim.skinning.stretch import pivots, split, topmost


@dataclass(frozen=True, slots=True)
class Packed:
    """Rigid motions (J, 8, L) and what is stretched before them, (J, 12, L) or (0, 12, L)."""

    duals: Singles
    stretches: Singles


@dataclass(frozen=True)
class DualQuaternion:
    """Blends rigid motions as dual quaternions, after stretches linearly; weights count as shares of their sum.

    One influence gives exactly its matrix: scale, shear and mirror included.
    Source: Kavan, Collins, Žára & O'Sullivan 2008, "Geometric Skinning with Approximate Dual Quaternion Blending",
    sections 3 and 4; the pivot is the strongest influence, and stretches lie about the joints' own places.
    """

    rig: Rig
    held: Held = field(init=False, repr=False)
    pivots: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "held", self.rig.held._replace(weight=whole_weights(self.rig)))
        object.__setattr__(self, "pivots", pivots(self.rig))

    def pack(self, matrices: Floats) -> Packed:
        """Return the matrices (n, J, 3, 4) as the kernel reads them."""
        parts = split(matrices, self.pivots, topmost(self.rig.above))
        rigid = lanes(duals.from_rigid(parts.rotation, parts.translation))
        return Packed(rigid, np.empty((0, 12, LANES), np.float32) if parts.stretch is None else lanes(parts.stretch))

    def place(self, packed: Packed, shape: Shape, target: Target, first: int, last: int) -> None:
        """Write vertices first … last of all frames."""
        into = (first, last, room(self.rig.most), target)
        compiled(around_duals)(shape, self.held, packed.duals, packed.stretches, *into)
