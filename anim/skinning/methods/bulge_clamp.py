"""Distance of skin from the bones between its joints, and a clamp against bulges."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix
from anim.skinning.binding import SkinBinding
from anim.skinning.kernels.layout import FloatArray, OutputSlice, VertexBlock
from anim.skinning.methods.skinner import Skinner
from anim.skinning.polar_decomposition import joint_origins


@dataclass(frozen=True, slots=True)
class BoneSegments:
    """The bones of a skin: from each joint to its children, or the joint's own position for a leaf.

    start: (J + 1,) into tips (B,): joint indices at the far ends. distance: (V,) m from each vertex to the nearest bone
    of its joints in bind pose. fraction: (V,) 1 for two equal weights, 0 for a single joint.
    joints: (J, 3) m, positions in bind pose.
    """

    start: Ints
    tips: Ints
    distance: FloatArray
    fraction: FloatArray
    joints: Floats


def bone_segments(rig: SkinBinding) -> BoneSegments:
    """Return the bones of a rig with the distances of its vertices."""
    start, tips = bone_tips(rig.ancestors)
    found = BoneSegments(start, tips, np.zeros(len(rig.points), np.float32), _blend_weight(rig), joint_origins(rig))
    points, at = rig.points[None].astype(np.float32), found.joints[None].astype(np.float32)
    squared = np.zeros((1, len(rig.points)), np.float32)
    from anim.skinning.kernels.bone_distance import squared_bone_distance

    squared_bone_distance(points, 0, rig.start, rig.joint, start, found.tips, at, squared)
    return BoneSegments(start, found.tips, np.sqrt(squared[0]), found.fraction, found.joints)


def bone_tips(above: Ints) -> tuple[Ints, Ints]:
    """Return the places (J + 1,) of joints in the list of their bones' far ends, and that list: children, or itself.

    bone_tips([-1, 0, 0]) → [0, 2, 3, 4], [1, 2, 1, 2]
    """
    joints = np.arange(len(above))
    children = joints[above >= 0]
    leaves = np.flatnonzero(np.bincount(above[children], minlength=len(above)) == 0)
    owners = np.concatenate((above[children], leaves))
    tips = np.concatenate((children, leaves))
    start = np.concatenate(([0], np.cumsum(np.bincount(owners, minlength=len(above)))))
    return start, tips[np.argsort(owners, kind="stable")]


@dataclass(frozen=True)
class BulgeClamp:
    """A method with a clamp of vertices to their distance from the bones in bind pose.

    Weighted by the blend of two joints: vertices of one joint stay. Distances grow with the pivot's scale.
    Source: the idea of Kim & Han 2014, "Bulging-free dual quaternion skinning", with the nearest bone for their axis.
    """

    inner: Skinner
    rig: SkinBinding
    links: BoneSegments = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "links", bone_segments(self.rig))

    def pack(self, matrices: Floats) -> tuple[Any, FloatArray, FloatArray]:
        """Return the packed matrices of the inner method, joint positions (n, J, 3), and their scales (n, J)."""
        return self.inner.pack(matrices), *clamp_positions(self.links, matrices)

    def skin(
        self, packed: tuple[Any, FloatArray, FloatArray], shape: VertexBlock, target: OutputSlice, first: int, last: int
    ) -> None:
        """Write vertices first … last of all frames."""
        from anim.skinning.kernels.bone_distance import clamp_to_bones

        inner, joints, scales = packed
        self.inner.skin(inner, shape, target, first, last)
        start, joint, links = self.rig.start, self.rig.joint, self.links
        moved = (joints, scales, links.distance, links.fraction, first, last)
        clamp_to_bones(target.positions, target.at, start, joint, links.start, links.tips, *moved)


def clamp_positions(of: BoneSegments, matrices: Floats) -> tuple[FloatArray, FloatArray]:
    """Return positions (n, J, 3) and scales (n, J) of joints under matrices (n, J, 3, 4)."""
    at = matrix.apply(matrices, of.joints[:, None])[..., 0, :]
    scales = np.cbrt(np.abs(np.linalg.det(matrices[..., :3])))
    return at.astype(np.float32), scales.astype(np.float32)


def _blend_weight(rig: SkinBinding) -> FloatArray:
    """1 − (w₁ − w₂)² of the two strongest weights, as fractions of their sum; 0 for one weight."""
    counts = np.diff(rig.start)
    two = counts > 1
    strongest, second = np.zeros(len(counts)), np.zeros(len(counts))
    strongest[counts > 0] = rig.weight[rig.start[:-1][counts > 0]]
    second[two] = rig.weight[rig.start[:-1][two] + 1]
    apart = np.divide(strongest - second, strongest + second, out=np.ones(len(counts)), where=counts > 0)
    return (1 - apart**2).astype(np.float32)
