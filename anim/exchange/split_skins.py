"""Split a skinned mesh by skeleton tree: the joints of a glTF skin must have a common root."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anim.arrays import Ints
from anim.model import Mesh, Skeleton, Skin


def split_by_root(skeleton: Skeleton, mesh: Mesh, skin: Skin) -> list[tuple[Mesh, Skin]]:
    """Return a mesh and its skin for each root that has joints, with numbered names if several.

    mesh: each triangle is bound to joints of one tree, without shared vertices.
    """
    root_of = _roots(skeleton)[skin.joints]
    roots = np.unique(root_of)
    if len(roots) < 2:
        return [(mesh, skin)]
    bodies = []
    for number, root in enumerate(roots.tolist(), 1):
        own = np.flatnonzero(root_of == root)
        place: Ints = np.zeros(len(skin.joints), np.int64)
        place[own] = np.arange(len(own))
        kept = np.flatnonzero(root_of[mesh.joints[:, 0]] == root)
        new: Ints = np.zeros(len(mesh.positions), np.int64)
        new[kept] = np.arange(len(kept))
        body = replace(
            mesh,
            name=f"{mesh.name} {number}",
            positions=mesh.positions[kept],
            normals=None if mesh.normals is None else mesh.normals[kept],
            faces=new[mesh.faces[np.isin(mesh.faces[:, 0], kept)]],
            joints=place[mesh.joints[kept]],
            weights=mesh.weights[kept],
            targets=mesh.targets[:, kept],
        )
        bodies.append((body, Skin(skin.joints[own], skin.inverse_bind[own])))
    return bodies


def _roots(skeleton: Skeleton) -> Ints:
    """Index of the root above each node (N,)."""
    found: Ints = np.arange(len(skeleton))
    for level in skeleton.levels()[1:]:
        found[level] = found[skeleton.parents[level]]
    return found
