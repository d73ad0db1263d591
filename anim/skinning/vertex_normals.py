"""Normals of moving vertices that have none of their own: the mean of their faces, by area."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Ints
from anim.skinning.kernels.layout import FloatArray


@dataclass(frozen=True)
class SmoothNormals:
    """Unit normals (n, V, 3) of frames; a vertex without faces, or whose faces cancel out, gets 0.

    glTF wants flat shading where normals are missing. A cache has one normal a vertex, so that is what comes out
    where no vertices are shared between faces, and the smooth look elsewhere.
    """

    faces: Ints
    vertices: int

    def of(self, positions: FloatArray, normals: FloatArray) -> None:
        """Write the normals of positions (n, V, 3) into `normals`."""
        from anim.skinning.kernels.vertex_normals import vertex_normals

        vertex_normals(self.faces, np.asarray(positions), normals)
