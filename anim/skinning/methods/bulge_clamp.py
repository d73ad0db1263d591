"""How far skin stands off the links between its joints, and a clamp that pulls back what bulges."""

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
    """The links of a skin: from each joint to those below it, or the joint's own place where none is below.

    start: (J + 1,) into tips (B,): joint numbers at the far ends. distance: (V,) m from each vertex to the nearest link
    of its joints in bind pose. share: (V,) 1 where two joints hold a vertex equally, 0 where one holds it alone.
    joints: (J, 3) m, where they are in bind pose.
    """

    start: Ints
    tips: Ints
    distance: FloatArray
    fraction: FloatArray
    joints: Floats


def bone_segments(rig: SkinBinding) -> BoneSegments:
    """Return the links of a rig and how far its vertices are from them."""
    count = len(rig.nodes)
    below = [np.flatnonzero(rig.ancestors == j) for j in range(count)]
    tips = [each if len(each) else np.array([j]) for j, each in enumerate(below)]
    start = np.cumsum([0, *map(len, tips)])
    found = BoneSegments(
        start, np.concatenate(tips), np.zeros(len(rig.points), np.float32), _blend_weight(rig), joint_origins(rig)
    )
    points, at = rig.points[None].astype(np.float32), found.joints[None].astype(np.float32)
    squared = np.zeros((1, len(rig.points)), np.float32)
    from anim.skinning.kernels.bone_distance import squared_bone_distance

    squared_bone_distance(points, 0, rig.start, rig.joint, start, found.tips, at, squared)
    return BoneSegments(start, found.tips, np.sqrt(squared[0]), found.fraction, found.joints)


@dataclass(frozen=True)
class BulgeClamp:
    """A method whose vertices are pulled back to the distance from their links that they have in bind pose.

    As much as two joints share a vertex: what one joint holds alone stays. Distances grow with the pivot's scale.
    Source: the idea of Kim & Han 2014, "Bulging-free dual quaternion skinning", with the nearest link for their axis.
    """

    inner: Skinner
    rig: SkinBinding
    links: BoneSegments = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "links", bone_segments(self.rig))

    def pack(self, matrices: Floats) -> tuple[Any, FloatArray, FloatArray]:
        """Return what the inner method needs, where joints are (n, J, 3), and their scales (n, J)."""
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
    """Return where joints stand (n, J, 3) under matrices (n, J, 3, 4), and how much they scale (n, J)."""
    at = matrix.apply(matrices, of.joints[:, None])[..., 0, :]
    scales = np.cbrt(np.abs(np.linalg.det(matrices[..., :3])))
    return at.astype(np.float32), scales.astype(np.float32)


def _blend_weight(rig: SkinBinding) -> FloatArray:
    """1 − (w₁ − w₂)² of the two strongest weights, as shares of the two; 0 where there is one."""
    counts = np.diff(rig.start)
    two = counts > 1
    strongest, second = np.zeros(len(counts)), np.zeros(len(counts))
    strongest[counts > 0] = rig.weight[rig.start[:-1][counts > 0]]
    second[two] = rig.weight[rig.start[:-1][two] + 1]
    apart = np.divide(strongest - second, strongest + second, out=np.ones(len(counts)), where=counts > 0)
    return (1 - apart**2).astype(np.float32)
