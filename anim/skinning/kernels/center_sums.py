"""Surface integrals for centers of rotation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Floats, Ints
from anim.skinning.kernels.jit import jit
from anim.skinning.kernels.layout import FloatArray


@jit
def accumulate_centers(
    start: Ints,
    joint: NDArray[np.int32],
    weight: FloatArray,
    joints: int,
    key: Ints,
    row_start: Ints,
    weights: Floats,
    area: Floats,
    moment: Floats,
    sharpness: float,
    sums: Floats,
) -> None:
    """Add moment and area (V, 4) of all triangles to each vertex, by their similarity."""
    for v in range(len(sums)):
        for e in range(start[v], start[v + 1]):
            for other in range(e + 1, start[v + 1]):
                a, b = e, other
                if joint[a] > joint[b]:
                    a, b = b, a
                wanted = np.int64(joint[a]) * joints + joint[b]
                at = _find(key, wanted)
                if at == len(key) or key[at] != wanted:
                    continue
                wa, wb = np.float64(weight[a]), np.float64(weight[b])
                for r in range(row_start[at], row_start[at + 1]):
                    ta, tb = weights[r, 0], weights[r, 1]
                    apart = wa * tb - wb * ta
                    similar = wa * wb * ta * tb * np.exp(-apart * apart * sharpness)
                    sums[v, 0] += similar * moment[r, 0]
                    sums[v, 1] += similar * moment[r, 1]
                    sums[v, 2] += similar * moment[r, 2]
                    sums[v, 3] += similar * area[r]


@jit
def _find(keys: Ints, wanted: int) -> int:
    """Index of the first key ≥ `wanted`, by bisection: numba's own takes a second more to compile."""
    low, high = 0, len(keys)
    while low < high:
        middle = (low + high) // 2
        if keys[middle] < wanted:
            low = middle + 1
        else:
            high = middle
    return low
