"""Add meshes and nodes to a document; everything that it has keeps its index and its bytes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Floats, Ints
from anim.gltf.document import Document, Json, json_array
from anim.gltf.reading.accessors import DTYPES
from anim.gltf.writing import references
from anim.gltf.writing.buffer_views import View
from anim.gltf.writing.buffers import rebuild_buffers
from anim.gltf.writing.encoding import BY_WIDTH

VERTICES, INDICES = 34962, 34963  # buffer view targets
MAX_UINT16 = 65_534  # the largest value restarts primitives
COMPONENT_TYPES = {np.dtype(dtype).str: component for component, dtype in DTYPES.items()}
ELEMENTS = {**BY_WIDTH, 16: "MAT4"}
Contents: TypeAlias = list[tuple[NDArray[np.generic], int | None]]  # rows (n, C), and the target of their view


def append_accessors(document: Document, contents: Contents) -> tuple[Document, list[int]]:
    """Return the document with new accessors, each with a buffer view of its own, and their indices.

    contents: rows (n, C) of a type that glTF stores, little-endian, and the target of the view or None. `min` and
    `max` are given for vertices of three components, as the specification requires of positions.
    """
    outside = references.references_outside(document.json, set())
    views = [View(rows.tobytes(), rows.nbytes) for rows, _ in contents]
    built = rebuild_buffers(document, set(), set(), outside, views, "")
    old_views, accessors = json_array(document.json, "bufferViews"), [*json_array(document.json, "accessors")]
    for i, (rows, target) in enumerate(contents):
        if target is not None:
            built.views[i]["target"] = target
        accessors.append(_accessor(len(old_views) + i, rows, has_bounds=target == VERTICES and rows.shape[1] == 3))
    json = {
        **document.json,
        "accessors": accessors,
        "bufferViews": [*old_views, *built.views],
        "buffers": built.described,
    }
    first = len(accessors) - len(contents)
    return Document(json, built.buffers, document.chunks, document.indent), list(range(first, len(accessors)))


def append_mesh(
    document: Document,
    name: str,
    positions: Floats,
    faces: Ints,
    normals: Floats | None = None,
    material: Json | None = None,
) -> tuple[Document, int]:
    """Return the document with a new mesh of one primitive, and the mesh's index.

    positions, normals: (V, 3). faces: (T, 3) vertex indices. material: its JSON, appended to `materials`.
    """
    document, indices = append_accessors(document, mesh_accessors(positions, faces, normals))
    attributes = dict(zip(("POSITION", "NORMAL"), indices[1:], strict=False))
    primitive: Json = {"attributes": attributes, "indices": indices[0]}
    json = dict(document.json)
    if material is not None:
        json["materials"] = [*json_array(json, "materials"), material]
        primitive["material"] = len(json["materials"]) - 1
    json["meshes"] = [*json_array(json, "meshes"), {"name": name, "primitives": [primitive]}]
    return _with_json(document, json), len(json["meshes"]) - 1


def mesh_accessors(positions: Floats, faces: Ints, normals: Floats | None = None) -> Contents:
    """Return the contents of a mesh's accessors: indices, positions, and normals if there are some."""
    index_type = "<u2" if len(positions) <= MAX_UINT16 else "<u4"
    contents: Contents = [
        (faces.reshape(-1, 1).astype(index_type), INDICES),
        (positions.astype("<f4"), VERTICES),
    ]
    if normals is not None:
        contents.append((normals.astype("<f4"), VERTICES))
    return contents


def append_nodes(document: Document, nodes: Sequence[Json], *, in_scene: bool = True) -> tuple[Document, list[int]]:
    """Return the document with new nodes, and their indices.

    nodes: their JSON. in_scene: as root nodes of the default scene; a document without a scene gets one. Else they are
    for a parent to name as its children.
    """
    json = dict(document.json)
    first = len(json_array(json, "nodes"))
    indices = list(range(first, first + len(nodes)))
    json["nodes"] = [*json_array(json, "nodes"), *nodes]
    if not in_scene:
        return _with_json(document, json), indices
    scenes = [*json_array(json, "scenes")]
    if not scenes:
        scenes, json["scene"] = [{}], 0
    number = json.get("scene", 0)
    scenes[number] = {**scenes[number], "nodes": [*json_array(scenes[number], "nodes"), *indices]}
    json["scenes"] = scenes
    return _with_json(document, json), indices


def _accessor(view: int, rows: NDArray[np.generic], *, has_bounds: bool) -> Json:
    about: Json = {
        "bufferView": view,
        "componentType": COMPONENT_TYPES[rows.dtype.str],
        "count": len(rows),
        "type": ELEMENTS[rows.shape[1]],
    }
    if has_bounds:
        about["min"] = [float(value) for value in rows.min(axis=0)]
        about["max"] = [float(value) for value in rows.max(axis=0)]
    return about


def _with_json(document: Document, json: Json) -> Document:
    return Document(json, document.buffers, document.chunks, document.indent)
