"""Area-weighted vertex normals for meshes without normals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Ints
from anim.skinning.kernels.layout import FloatArray


@dataclass(frozen=True)
class SmoothNormals:
    """Unit normals (n, V, 3) of frames; 0 for a vertex without faces, or whose faces cancel out.

    glTF requires flat shading if normals are missing. A cache has one normal per vertex, so shading is flat only if no
    vertices are shared between faces, and smooth elsewhere.
    """

    faces: Ints
    vertices: int

    def of(self, positions: FloatArray, normals: FloatArray) -> None:
        """Write the normals of positions (n, V, 3) into `normals`."""
        from anim.skinning.kernels.vertex_normals import vertex_normals

        vertex_normals(self.faces, np.asarray(positions), normals)
