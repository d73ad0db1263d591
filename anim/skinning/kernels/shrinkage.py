"""How much smaller linear blending makes the space around vertices."""

from __future__ import annotations

import numpy as np

from anim.skinning.kernels.lanes import LANES, Held, Room, Singles
from anim.skinning.kernels.sums import blend


def shrinkage(held: Held, matrices: Singles, logs: Singles, room: Room, factors: Singles) -> None:
    """Write det(Σ w A) / Π |det A|^w of vertices into factors (V, n); matrices (J, 12, L).

    logs: (J, L) of |det A|, or (0, L) where all are 1.
    """
    m, found, size = room.matrix, room.center[0], room.center[1]
    for v in range(len(factors)):
        blend(m, matrices, held, v, room.shares)
        for f in range(LANES):
            x = m[5, f] * m[10, f] - m[6, f] * m[9, f]
            y = m[6, f] * m[8, f] - m[4, f] * m[10, f]
            z = m[4, f] * m[9, f] - m[5, f] * m[8, f]
            found[f] = m[0, f] * x + m[1, f] * y + m[2, f] * z
        if len(logs):
            for f in range(LANES):
                size[f] = 0
            for e in range(held.start[v], held.start[v + 1]):
                w, row = held.weight[e], logs[held.joint[e]]
                for f in range(LANES):
                    size[f] += w * row[f]
            for f in range(LANES):
                found[f] *= np.exp(-size[f])
        for f in range(factors.shape[1]):
            factors[v, f] = found[f]
