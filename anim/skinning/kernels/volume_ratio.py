"""Kernel of the volume factor of linear blending around vertices."""

from __future__ import annotations

import numpy as np

from anim.skinning.kernels.jit import jit
from anim.skinning.kernels.layout import LANES, FloatArray, Influences
from anim.skinning.kernels.weighted_sum import blend


@jit
def volume_ratio(influences: Influences, matrices: FloatArray, logs: FloatArray, factors: FloatArray) -> None:
    """Write det(Σ w A) / Π |det A|^w of vertices into factors (V, n).

    matrices: (J, 12, L). logs: (J, L) of |det A|.
    """
    m, found, size = np.empty((12, LANES), np.float32), np.empty(LANES, np.float32), np.empty(LANES, np.float32)
    for v in range(len(factors)):
        blend(m, matrices, influences, v, 12)
        for f in range(LANES):
            x = m[5, f] * m[10, f] - m[6, f] * m[9, f]
            y = m[6, f] * m[8, f] - m[4, f] * m[10, f]
            z = m[4, f] * m[9, f] - m[5, f] * m[8, f]
            found[f] = m[0, f] * x + m[1, f] * y + m[2, f] * z
            size[f] = 0
        for e in range(influences.start[v], influences.start[v + 1]):
            w, row = influences.weight[e], logs[influences.joint[e]]
            for f in range(LANES):
                size[f] += w * row[f]
        for f in range(factors.shape[1]):
            factors[v, f] = found[f] * np.exp(-size[f])
