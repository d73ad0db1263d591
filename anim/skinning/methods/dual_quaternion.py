"""Dual-quaternion skinning: twisted limbs keep their volume."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from anim.arrays import Floats
from anim.maths import dual_quaternion as duals
from anim.maths import quaternion
from anim.skinning.binding import SkinBinding
from anim.skinning.kernels.layout import FloatArray, OutputSlice, ScaleShear, VertexBlock, output, vertices
from anim.skinning.methods.skinner import lanes
from anim.skinning.weighted_joints import WeightedJoints


@dataclass(frozen=True, slots=True)
class Packed:
    """Rigid motions of joints with weight (U, 8, L); (U, 12, L) with scale-shear.

    The last four are added to the dual part for each unit of scale.
    """

    duals: FloatArray
    scale_shear: ScaleShear | None


@dataclass(frozen=True)
class DualQuaternion:
    """Blends rigid motions as dual quaternions, after a linear blend of scale-shear.

    One influence gives exactly its matrix: scale, shear and mirror included.
    Source: Kavan, Collins, Žára & O'Sullivan 2008, "Geometric Skinning with Approximate Dual Quaternion Blending",
    sections 3 and 4; the pivot is the strongest influence, and scale-shear is about the joints' own positions.
    """

    rig: SkinBinding
    weighted_joints: WeightedJoints = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "weighted_joints", WeightedJoints(self.rig))

    def pack(self, matrices: Floats) -> Packed:
        """Return the matrices (n, J, 3, 4) in the kernel's layout."""
        parts = self.weighted_joints.split(matrices)
        rigid = duals.from_rigid(parts.rotation, parts.translation)
        if parts.scale_shear is not None:
            turned = quaternion.rotate(parts.rotation, self.weighted_joints.pivots)
            rigid = np.concatenate((rigid, duals.from_rigid(parts.rotation, -turned)[..., 4:]), axis=-1)
        return Packed(lanes(rigid), self.weighted_joints.scale_shear(parts))

    def skin(self, packed: Packed, shape: VertexBlock, target: OutputSlice, first: int, last: int) -> None:
        """Write vertices first … last of all frames."""
        from anim.skinning.kernels.dual_quaternion import skin_dual_quaternion

        moves = (self.weighted_joints.influences, packed.duals, packed.scale_shear)
        skin_dual_quaternion(*vertices(shape), *moves, first, last, *output(target))
