"""Kernel of vertex normals from the faces around them."""

from __future__ import annotations

import numpy as np

from anim.arrays import Ints
from anim.skinning.kernels.jit import jit
from anim.skinning.kernels.layout import FloatArray


@jit
def vertex_normals(faces: Ints, positions: FloatArray, normals: FloatArray) -> None:
    """Write unit normals of positions (n, V, 3): area-weighted sums of the faces' normals."""
    for f in range(len(positions)):
        p, n = positions[f], normals[f]
        for v in range(len(n)):
            n[v, 0] = n[v, 1] = n[v, 2] = 0
        for t in range(len(faces)):
            a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
            ux, uy, uz = p[b, 0] - p[a, 0], p[b, 1] - p[a, 1], p[b, 2] - p[a, 2]
            vx, vy, vz = p[c, 0] - p[a, 0], p[c, 1] - p[a, 1], p[c, 2] - p[a, 2]
            x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            for corner in (a, b, c):
                n[corner, 0] += x
                n[corner, 1] += y
                n[corner, 2] += z
        for v in range(len(n)):
            length = np.sqrt(n[v, 0] * n[v, 0] + n[v, 1] * n[v, 1] + n[v, 2] * n[v, 2])
            if length > 0:
                n[v, 0] /= length
                n[v, 1] /= length
                n[v, 2] /= length
