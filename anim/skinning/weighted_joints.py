"""The joints of a rig with weight, in the layout of rotation-based methods."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths.hierarchy import find_subtrees
from anim.skinning.binding import SkinBinding
from anim.skinning.kernels.layout import FloatArray, Influences, ScaleShear, group_influences
from anim.skinning.methods.skinner import lanes
from anim.skinning.polar_decomposition import PolarDecomposition, decompose, decompose_after, joint_origins

SCALE_TOLERANCE = 1e-4  # deviation of a bind matrix's stretch from a uniform one


@dataclass(frozen=True)
class WeightedJoints:
    """Joints with weight; others may have any bind scale, and move nothing.

    used: (U,) their indices in the rig, increasing. shape: (3, 3) bind_from_mesh, symmetric, None for 1: a mesh bound
    with a non-uniform scale is stretched first. pivots: (U, 3) m, positions of the joints in bind space. influences: by
    indices into `used`. scale_influences: the same influences with the fractions of their scales in that of the vertex.
    """

    rig: SkinBinding
    used: Ints = field(init=False, repr=False)
    shape: Floats | None = field(init=False, repr=False)
    pivots: Floats = field(init=False, repr=False)
    influences: Influences = field(init=False, repr=False)
    scale_influences: Influences = field(init=False, repr=False)

    def __post_init__(self) -> None:
        used = np.unique(self.rig.joint).astype(np.int64)
        influences = self.rig.influences._replace(joint=np.searchsorted(used, self.rig.joint).astype(np.int32))
        shape, places = bind_shape(self.rig), joint_origins(self.rig)[used]
        for name, value in (
            ("used", used),
            ("shape", shape),
            ("pivots", places if shape is None else places @ shape),
            ("influences", group_influences(influences)),
            ("scale_influences", group_influences(influences._replace(weight=scale_fractions(self.rig)))),
        ):
            object.__setattr__(self, name, value)

    def split(self, matrices: Floats) -> PolarDecomposition:
        """Return the decomposition of matrices (n, J, 3, 4) of all of the rig's joints, for those with weight."""
        mine = matrices if len(self.used) == matrices.shape[1] else matrices[:, self.used]
        return decompose(mine, self.pivots) if self.shape is None else decompose_after(mine, self.pivots, self.shape)

    def scale_shear(self, parts: PolarDecomposition) -> ScaleShear | None:
        """Return scale-shear in the layout of kernels, None for rigid parts."""
        if parts.scale_shear is None or parts.scale is None:
            return None
        rows = parts.scale_shear.reshape(*parts.scale.shape, 12)
        places = np.broadcast_to(self.pivots, (*parts.scale.shape, 3))
        return ScaleShear(lanes(np.concatenate((rows, places), axis=-1)), lanes(parts.scale), self.scale_influences)


def bind_shape(rig: SkinBinding) -> Floats | None:
    """Return the symmetric matrix (3, 3) of determinant 1 of the bind matrices' stretch, None for none.

    A bind matrix is a rotation after a stretch; this is the stretch without its scale, the mean over the joints by
    their weight. Exporters leave it there if a mesh with a non-uniform scale was bound.
    """
    weight = np.bincount(rig.joint, rig.weight, minlength=len(rig.bind))
    used = np.flatnonzero(weight)
    _, factors, axes = np.linalg.svd(rig.bind[used, :, :3])
    sizes = np.prod(factors, axis=1)
    weight[used[sizes == 0]] = 0
    if not weight.any():
        return None
    even = factors / np.cbrt(np.where(sizes > 0, sizes, 1))[:, None]
    stretch = np.swapaxes(axes, -1, -2) @ (even[..., None] * axes)
    shape = (stretch * weight[used, None, None]).sum(axis=0) / weight.sum()
    return None if np.abs(shape - np.eye(3)).max() < SCALE_TOLERANCE else shape


def scale_fractions(rig: SkinBinding) -> FloatArray:
    """Return the fractions (E,) of the joints' scales in the single scale of each vertex.

    The distance of two blended joints follows the scale of the upper one, so each pair takes that one's;
    if neither is an ancestor of the other, the mean of both. Pairs count by the product of their weights. So only
    the vertex's own joints matter, and the fractions change as smoothly as the weights.
    (hip 0.75, knee 0.25) → 1, 0
    """
    counts = np.diff(rig.start)
    there = np.arange(rig.max_count) < counts[:, None]
    places = np.where(there, rig.start[:-1, None] + np.arange(rig.max_count), 0)
    joint = np.where(there, rig.joint[places] if len(rig.joint) else 0, 0)
    weight = np.where(there, rig.weight[places] if len(rig.joint) else 0, 0).astype(np.float64)
    fractions = np.zeros(weight.shape)
    first, end = (each[joint] for each in find_subtrees(rig.ancestors))
    for i in range(rig.max_count):
        for k in range(i + 1, rig.max_count):
            is_upper = (first[:, i] < first[:, k]) & (first[:, k] < end[:, i])
            is_lower = (first[:, k] < first[:, i]) & (first[:, i] < end[:, k])
            part = 0.5 + (is_upper.astype(np.float64) - is_lower) / 2
            amount = weight[:, i] * weight[:, k]
            fractions[:, i] += amount * part
            fractions[:, k] += amount * (1 - part)
    alone = fractions.sum(axis=1) == 0
    fractions[alone] = np.arange(rig.max_count) == 0
    fractions /= np.maximum(fractions.sum(axis=1, keepdims=True), np.finfo(float).tiny)
    return fractions[there].astype(np.float32)
