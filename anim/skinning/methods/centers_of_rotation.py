"""Skinning with optimized centers of rotation: limbs neither pinch when twisted nor bulge when bent."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from anim.arrays import Floats
from anim.maths import quaternion
from anim.skinning.binding import SkinBinding
from anim.skinning.kernels.layout import FloatArray, OutputSlice, ScaleShear, VertexBlock, output, vertices
from anim.skinning.methods.rotation_centers import find_centers
from anim.skinning.methods.skinner import lanes
from anim.skinning.weighted_joints import WeightedJoints


@dataclass(frozen=True, slots=True)
class Packed:
    """Rotations (U, 4, L) and rigid motions (U, 12, L) of joints with weight; (U, 15, L) with scale-shear.

    The last three are added to the translation for each unit of scale.
    """

    rotations: FloatArray
    rigids: FloatArray
    scale_shear: ScaleShear | None


@dataclass(frozen=True)
class CentersOfRotation:
    """Rotates each vertex by the blended quaternion about a center that blends linearly.

    The center belongs to the mesh at rest, morph targets don't move it. Scale-shear comes first, as with dual
    quaternions. Source: Le & Hodgins 2016, "Real-time Skeletal Skinning with Optimized Centers of Rotation", algorithm
    1.
    """

    rig: SkinBinding
    weighted_joints: WeightedJoints = field(init=False, repr=False)
    centers: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "weighted_joints", WeightedJoints(self.rig))
        object.__setattr__(self, "centers", find_centers(self.rig).astype(np.float32)[:, :, None])

    def pack(self, matrices: Floats) -> Packed:
        """Return the matrices (n, J, 3, 4) in the kernel's layout."""
        parts = self.weighted_joints.split(matrices)
        turn = quaternion.to_matrix(parts.rotation)
        rigid = np.concatenate((turn, parts.translation[..., None]), axis=-1).reshape(*turn.shape[:2], 12)
        if parts.scale_shear is not None:
            rigid = np.concatenate((rigid, -quaternion.rotate(parts.rotation, self.weighted_joints.pivots)), axis=-1)
        return Packed(lanes(parts.rotation), lanes(rigid), self.weighted_joints.scale_shear(parts))

    def skin(self, packed: Packed, shape: VertexBlock, target: OutputSlice, first: int, last: int) -> None:
        """Write vertices first … last of all frames."""
        from anim.skinning.kernels.centers import skin_centers

        moves = (packed.rotations, packed.rigids, packed.scale_shear)
        skin_centers(
            *vertices(shape), self.centers, self.weighted_joints.influences, *moves, first, last, *output(target)
        )
