"""Closed parts of a mesh, and their enclosed volume."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from anim.arrays import AnyArray, Bools, Floats, Ints


def watertight_faces_of_all(shapes: Sequence[tuple[Floats, Ints]]) -> list[Bools]:
    """Return the faces of closed parts of many shapes, (V, 3) points and (T, 3) faces each; of equal ones once."""
    found: dict[tuple[bytes, bytes], Bools] = {}
    masks = []
    for points, faces in shapes:
        key = points.tobytes(), faces.tobytes()
        if key not in found:
            found[key] = watertight_faces(points, faces) if len(faces) else np.zeros(0, bool)
        masks.append(found[key])
    return masks


def watertight_faces(points: Floats, faces: Ints) -> Bools:
    """Return the faces (T,) of closed parts: with equal points merged, every edge has two opposite faces.

    Points are equal if they agree to trimesh's tolerance (1e-8 m). A part with inconsistent winding has no volume and
    counts as open.
    """
    import trimesh

    mesh = trimesh.Trimesh(points, faces, process=False, validate=False)
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    merged = np.asarray(mesh.faces)
    flat = (merged[:, 0] == merged[:, 1]) | (merged[:, 1] == merged[:, 2]) | (merged[:, 2] == merged[:, 0])
    edges = np.concatenate([merged[:, [0, 1]], merged[:, [1, 2]], merged[:, [2, 0]]])
    owner = np.tile(np.arange(len(merged)), 3)
    kept = ~flat[owner]
    edges, owner = edges[kept], owner[kept]
    _, edge, uses = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    ways = np.bincount(edge.ravel(), np.where(edges[:, 0] < edges[:, 1], 1, -1), minlength=len(uses))
    sound = (uses == 2) & (ways == 0)
    labels: Any = trimesh.graph.connected_component_labels
    label = labels(edges, node_count=len(mesh.vertices))[merged[:, 0]]
    leaky = np.zeros(label.max(initial=-1) + 1, np.bool_)
    leaky[label[owner[~sound[edge.ravel()]]]] = True
    return np.asarray(~leaky[label] & ~flat)


def volumes(positions: AnyArray, faces: Ints) -> Floats:
    """Return the volume (F,) in m³ of closed faces (T, 3) at positions (F, V, 3); negative inside out.

    A sixth of the sum of a · (b × c), about each frame's own center, so that far from the origin no digits are lost.
    """
    found = np.zeros(len(positions))
    for f, points in enumerate(positions):
        corners = points.astype(np.float64)
        corners = (corners - corners.mean(axis=0))[faces]
        found[f] = np.einsum("ti,ti->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    return found
