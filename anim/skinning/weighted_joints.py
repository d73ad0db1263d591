"""The joints of a rig that carry weight, as methods that turn vertices read them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from anim.arrays import Floats, Ints
from anim.skinning.binding import SkinBinding
from anim.skinning.kernels.layout import FloatArray, Influences, ScaleShear, group_influences
from anim.skinning.methods.skinner import lanes
from anim.skinning.polar_decomposition import PolarDecomposition, decompose, decompose_after, joint_origins

SCALE_TOLERANCE = 1e-4  # how far a bind matrix's stretch may be from a uniform one without being one


@dataclass(frozen=True)
class WeightedJoints:
    """Joints with weight: another one may have any bind scale, and moves nothing.

    used: (U,) their numbers in the rig, increasing. shape: (3, 3) bind_from_mesh, symmetric, None where it is 1: a mesh
    bound with a non-uniform scale is stretched first. pivots: (U, 3) m, where the joints stand in bind space.
    influences: by numbers into `used`. ruling: the same influences with
    the shares by which their scales make up that of the vertex.
    """

    rig: SkinBinding
    used: Ints = field(init=False, repr=False)
    shape: Floats | None = field(init=False, repr=False)
    pivots: Floats = field(init=False, repr=False)
    influences: Influences = field(init=False, repr=False)
    ruling: Influences = field(init=False, repr=False)

    def __post_init__(self) -> None:
        used = np.unique(self.rig.joint).astype(np.int64)
        held = self.rig.influences._replace(joint=np.searchsorted(used, self.rig.joint).astype(np.int32))
        shape, places = bind_shape(self.rig), joint_origins(self.rig)[used]
        for name, value in (
            ("used", used),
            ("shape", shape),
            ("pivots", places if shape is None else places @ shape),
            ("influences", group_influences(held)),
            ("ruling", group_influences(held._replace(weight=scale_fractions(self.rig)))),
        ):
            object.__setattr__(self, name, value)

    def split(self, matrices: Floats) -> PolarDecomposition:
        """Return the parts of matrices (n, J, 3, 4) of all of the rig's joints, for those with weight."""
        mine = matrices if len(self.used) == matrices.shape[1] else matrices[:, self.used]
        return decompose(mine, self.pivots) if self.shape is None else decompose_after(mine, self.pivots, self.shape)

    def scale_shear(self, parts: PolarDecomposition) -> ScaleShear | None:
        """Return stretches as kernels read them, None of rigid parts."""
        if parts.scale_shear is None or parts.scale is None:
            return None
        rows = parts.scale_shear.reshape(*parts.scale.shape, 12)
        places = np.broadcast_to(self.pivots, (*parts.scale.shape, 3))
        return ScaleShear(lanes(np.concatenate((rows, places), axis=-1)), lanes(parts.scale), self.ruling)


def bind_shape(rig: SkinBinding) -> Floats | None:
    """Return the symmetric matrix (3, 3) of determinant 1 by which bind matrices stretch the mesh, None for no stretch.

    A bind matrix is a rotation after a stretch; this is the stretch without its scale, the mean over the joints by
    their weight. Exporters leave it there where a mesh with a non-uniform scale was bound.
    """
    linear = rig.bind[..., :3]
    _, factors, axes = np.linalg.svd(linear)
    sizes = np.prod(factors, axis=1)
    weight = np.where(sizes > 0, np.bincount(rig.joint, rig.weight, minlength=len(linear)), 0)
    if not weight.any():
        return None
    even = factors / np.cbrt(np.where(sizes > 0, sizes, 1))[:, None]
    shape = np.average(np.swapaxes(axes, -1, -2) @ (even[..., None] * axes), axis=0, weights=weight)
    return None if np.abs(shape - np.eye(3)).max() < SCALE_TOLERANCE else shape


def scale_fractions(rig: SkinBinding) -> FloatArray:
    """Return the shares (E,) by which the scales of a vertex's joints make up the one scale of the vertex.

    Two joints that blend are as far apart as the scale of the upper one makes them, so each pair takes that one's;
    where none is above the other, the mean of both. Pairs count by the product of their weights. So nothing outside
    of the vertex's own joints matters, and the shares change as smoothly as the weights.
    (hip 0.75, knee 0.25) → 1, 0
    """
    counts = np.diff(rig.start)
    there = np.arange(rig.max_count) < counts[:, None]
    places = np.where(there, rig.start[:-1, None] + np.arange(rig.max_count), 0)
    joint = np.where(there, rig.joint[places] if len(rig.joint) else 0, 0)
    weight = np.where(there, rig.weight[places] if len(rig.joint) else 0, 0).astype(np.float64)
    shares, above = np.zeros(weight.shape), is_ancestor(rig.ancestors)
    for i in range(rig.max_count):
        for k in range(i + 1, rig.max_count):
            first = 0.5 + (above[joint[:, i], joint[:, k]] - above[joint[:, k], joint[:, i]]) / 2
            amount = weight[:, i] * weight[:, k]
            shares[:, i] += amount * first
            shares[:, k] += amount * (1 - first)
    alone = shares.sum(axis=1) == 0
    shares[alone] = np.arange(rig.max_count) == 0
    shares /= np.maximum(shares.sum(axis=1, keepdims=True), np.finfo(float).tiny)
    return shares[there].astype(np.float32)


def is_ancestor(above: Ints) -> Floats:
    """Return 1 where joint j hangs on joint i, anywhere below it (J, J), else 0. above: (J,), as in a rig.

    is_above([-1, 0]) → [[0, 1], [0, 0]]
    """
    found = np.zeros((len(above), len(above)))
    for j in range(len(above)):
        at = int(above[j])
        while at >= 0:
            found[at, j] = 1
            at = int(above[at])
    return found
