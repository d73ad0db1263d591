"""Split a skinned mesh by skeleton tree: the joints of a glTF skin must have a common root."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anim.arrays import Ints
from anim.model import Mesh, Skeleton, Skin


def split_by_root(
    skeleton: Skeleton, mesh: Mesh, skin: Skin, *, max_meshes: int | None = None
) -> list[tuple[Mesh, Skin]]:
    """Return a mesh and its skin for each root that has joints, with numbered names if several.

    mesh: each triangle is bound to joints of one tree, without shared vertices. max_meshes: of more roots neighbors
    share a mesh; programs draw it, but it is not valid glTF.
    """
    root_of = _roots(skeleton)[skin.joints]
    if max_meshes is not None:
        root_of = _grouped(root_of, max_meshes)
    roots = np.unique(root_of)
    if len(roots) < 2:
        return [(mesh, skin)]
    root_of_vertex = root_of[mesh.joints[:, 0]]
    root_of_face = root_of_vertex[mesh.faces[:, 0]]
    parts = zip(*(_parts(each, roots) for each in (root_of, root_of_vertex, root_of_face)), strict=True)
    place, new = _places(root_of, roots), _places(root_of_vertex, roots)
    bodies = []
    for number, (root, (own, kept, shown)) in enumerate(zip(roots.tolist(), parts, strict=True), 1):
        joints, faces = mesh.joints[kept], mesh.faces[shown]
        body = replace(
            mesh,
            name=f"{mesh.name} {number}",
            positions=mesh.positions[kept],
            normals=None if mesh.normals is None else mesh.normals[kept],
            faces=np.where(root_of_vertex[faces] == root, new[faces], 0),
            joints=np.where(root_of[joints] == root, place[joints], 0),
            weights=mesh.weights[kept],
            targets=mesh.targets[:, kept],
        )
        bodies.append((body, Skin(skin.joints[own], skin.inverse_bind[own])))
    return bodies


def _grouped(root_of: Ints, count: int) -> Ints:
    """Numbers (n,) of at most `count` groups of neighboring roots, from the root of each element."""
    roots, rank = np.unique(root_of, return_inverse=True)
    return np.asarray(rank // max(-(-len(roots) // count), 1), np.int64)


def _parts(root_of: Ints, roots: Ints) -> list[Ints]:
    """Indices of the elements (n,) with each root, increasing."""
    order = np.argsort(root_of, kind="stable")
    return np.split(order, np.searchsorted(root_of[order], roots[1:]))


def _places(root_of: Ints, roots: Ints) -> Ints:
    """Place of each element (n,) among those with its root."""
    found: Ints = np.empty(len(root_of), np.int64)
    for part in _parts(root_of, roots):
        found[part] = np.arange(len(part))
    return found


def _roots(skeleton: Skeleton) -> Ints:
    """Index of the root above each node (N,)."""
    found: Ints = np.arange(len(skeleton))
    for level in skeleton.levels()[1:]:
        found[level] = found[skeleton.parents[level]]
    return found
