"""Linear blend skinning, the method of every glTF player."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from anim.arrays import Floats
from anim.skinning.binding import SkinBinding
from anim.skinning.kernels.layout import (
    LANES,
    FloatArray,
    Influences,
    OutputSlice,
    VertexBlock,
    aligned,
    group_influences,
    output,
    vertices,
)
from anim.skinning.methods.skinner import lanes


@dataclass(frozen=True, slots=True)
class Packed:
    """The same matrices in two layouts. columns: (J, 4, 3L). rows: (J, 12, L)."""

    columns: FloatArray | None
    rows: FloatArray | None


@dataclass(frozen=True)
class LinearBlend:
    """Blends matrices: p′ = (Σ w M) p; normals by its inverse transpose, tangents by itself.

    plain: points are constant and no directions are requested; a faster kernel with equal results.
    Source: glTF 2.0, 3.7.3.1; Magnenat-Thalmann et al. 1988.
    """

    rig: SkinBinding
    plain: bool
    influences: Influences = field(init=False, repr=False)
    coefficients: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        owner = np.repeat(np.arange(len(self.rig.points)), np.diff(self.rig.start))
        whole = np.concatenate((self.rig.points, np.ones((len(self.rig.points), 1))), axis=1)
        weighted = self.rig.weight[:, None] * whole[owner] if self.plain else np.empty((0, 4))
        object.__setattr__(
            self, "influences", self.rig.influences if self.plain else group_influences(self.rig.influences)
        )
        object.__setattr__(self, "coefficients", weighted.astype(np.float32))

    def pack(self, matrices: Floats) -> Packed:
        """Return the matrices (n, J, 3, 4) in the kernel's layout."""
        if not self.plain:
            return Packed(None, lanes(matrices))
        frames, joints = matrices.shape[:2]
        columns = aligned(joints, 4, LANES, 3)
        columns[:, :, :frames] = matrices.transpose(1, 3, 0, 2)
        columns[:, :, frames:] = 0
        return Packed(columns.reshape(joints, 4, 3 * LANES), None)

    def skin(self, packed: Packed, shape: VertexBlock, target: OutputSlice, first: int, last: int) -> None:
        """Write vertices first … last of all frames."""
        if packed.columns is not None:
            from anim.skinning.kernels.linear_points import skin_linear_points

            coefficients, columns = self.coefficients, packed.columns
            skin_linear_points(coefficients, self.influences, columns, first, last, target.at, target.positions)
        elif packed.rows is not None:
            from anim.skinning.kernels.linear_full import skin_linear

            skin_linear(*vertices(shape), self.influences, packed.rows, first, last, *output(target))
