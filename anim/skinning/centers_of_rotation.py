"""Skinning with optimized centers of rotation: limbs neither pinch when twisted nor bulge when bent."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.skinning.centers import centers
from anim.skinning.compiled import compiled
from anim.skinning.kernels.around_centers import around_centers
from anim.skinning.kernels.lanes import LANES, Held, Shape, Singles, Target, room
from anim.skinning.rig import Rig, whole_weights
from anim.skinning.skinner import lanes
from anim.skinning.stretch import pivots, split, topmost


@dataclass(frozen=True, slots=True)
class Packed:
    """Rotations (J, 4, L), rigid motions (J, 12, L), and what is stretched before them, (J, 12, L) or (0, 12, L)."""

    turns: Singles
    rigids: Singles
    stretches: Singles


@dataclass(frozen=True)
class CentersOfRotation:
    """Turns each vertex by the blended quaternion about a center that blends linearly; weights as shares of their sum.

    The center belongs to the mesh at rest, morph targets don't move it. Stretches come first, as with dual quaternions.
    Source: Le & Hodgins 2016, "Real-time Skeletal Skinning with Optimized Centers of Rotation", algorithm 1.
    """

    rig: Rig
    held: Held = field(init=False, repr=False)
    pivots: Floats = field(init=False, repr=False)
    centers: Singles = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "held", self.rig.held._replace(weight=whole_weights(self.rig)))
        object.__setattr__(self, "pivots", pivots(self.rig))
        object.__setattr__(self, "centers", centers(self.rig).astype(np.float32)[:, :, None])

    def pack(self, matrices: Floats) -> Packed:
        """Return the matrices (n, J, 3, 4) as the kernel reads them."""
        parts = split(matrices, self.pivots, topmost(self.rig.above))
        rigid = np.concatenate((quaternion.to_matrix(parts.rotation), parts.translation[..., None]), axis=-1)
        stretches = np.empty((0, 12, LANES), np.float32) if parts.stretch is None else lanes(parts.stretch)
        return Packed(lanes(parts.rotation), lanes(rigid), stretches)

    def place(self, packed: Packed, shape: Shape, target: Target, first: int, last: int) -> None:
        """Write vertices first … last of all frames."""
        moves = (packed.turns, packed.rigids, packed.stretches)
        into = (first, last, room(self.rig.most), target)
        compiled(around_centers)(shape, self.centers, self.held, *moves, *into)
