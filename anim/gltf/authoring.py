"""Create a Document from a skeleton, clips and skinned meshes, with pygltflib."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from anim.arrays import AnyArray, Floats
from anim.gltf.authoring_parts import INDICES, VERTICES, add_accessor, create_document, create_material
from anim.gltf.document import Buffer, Document, Json, json_array
from anim.gltf.io import container, json_text
from anim.gltf.writing import writer
from anim.model import Clip, Mesh, Skeleton, Skin

if TYPE_CHECKING:
    from pygltflib import GLTF2


def build_document(skeleton: Skeleton, clips: Sequence[Clip], bodies: Sequence[tuple[Mesh, Skin]] = ()) -> Document:
    """Return a new document with the nodes of the skeleton, one node per body, and the clips.

    Node indices are those of the skeleton, which the clips and skins use. TRS properties equal to the identity are
    omitted. bodies: a mesh and its skin; the joints of the mesh are indices into the skin's joints.
    """
    gltf = create_document()
    blob = bytearray()
    for mesh, skin in bodies:
        _add_body(gltf, blob, mesh, skin)
    return add_clips(_document(gltf, bytes(blob), skeleton), clips)


def _insert_nodes(content: Json, skeleton: Skeleton) -> Json:
    """The JSON with the nodes of a skeleton before all others, where pygltflib puts them.

    Not by pygltflib: it takes 0.1 ms a node.
    """
    nodes, count = _nodes_json(skeleton), len(skeleton)
    bodies = content.get("nodes", [])
    roots = np.flatnonzero(skeleton.parents < 0).tolist()
    scene = {"nodes": [*roots, *range(count, count + len(bodies))]}
    items = [(key, value) for key, value in content.items() if key != "nodes"]
    place = [key for key, _ in items].index("scene")
    return dict([*items[:place], ("nodes", [*nodes, *bodies]), *items[place:]]) | {"scenes": [scene]}


def add_clips(document: Document, clips: Sequence[Clip]) -> Document:
    """Return the document with the clips appended to its animations. Clips without tracks are omitted.

    Everything else is unchanged.
    """
    clips = [clip for clip in clips if clip.tracks]
    if not clips:
        return document
    there = json_array(document.json, "animations")
    blank: list[Json] = [
        {**({"name": clip.name} if clip.name else {}), "channels": [], "samplers": []} for clip in clips
    ]
    longer = replace(document, json={**document.json, "animations": [*there, *blank]})
    return writer.replace_clips(longer, {len(there) + i: clip for i, clip in enumerate(clips)})


def _nodes_json(skeleton: Skeleton) -> list[Json]:
    nodes: list[Json] = [{} for _ in range(len(skeleton))]
    for key, none in (("rotation", (0.0, 0.0, 0.0, 1.0)), ("translation", (0.0,) * 3), ("scale", (1.0,) * 3)):
        values = getattr(skeleton, key)
        some = np.flatnonzero((values != none).any(axis=1))
        for number, value in zip(some.tolist(), (np.round(values[some], 9) + 0.0).tolist(), strict=True):
            nodes[number][key] = value
    for number, parent in enumerate(skeleton.parents.tolist()):
        if parent >= 0:
            nodes[parent].setdefault("children", []).append(number)
    for node, name in zip(nodes, skeleton.names, strict=True):
        if name:
            node["name"] = name
    return nodes


def _add_body(gltf: GLTF2, blob: bytearray, mesh: Mesh, skin: Skin) -> None:
    from pygltflib import Attributes, Node, Primitive
    from pygltflib import Mesh as GltfMesh
    from pygltflib import Skin as GltfSkin

    wide = len(skin.joints) > 256
    joints = mesh.joints.astype("<u2" if wide else "<u1")
    attributes = Attributes(
        POSITION=_add(gltf, blob, mesh.positions.astype("<f4"), VERTICES, bounds=True),
        JOINTS_0=_add(gltf, blob, joints, VERTICES),
        WEIGHTS_0=_add(gltf, blob, mesh.weights.astype("<f4"), VERTICES),
    )
    if mesh.normals is not None:
        attributes.NORMAL = _add(gltf, blob, mesh.normals.astype("<f4"), VERTICES)
    large = len(mesh.positions) > 65535
    faces = mesh.faces.reshape(-1, 1).astype("<u4" if large else "<u2")
    indices = _add(gltf, blob, faces, INDICES)
    gltf.materials.append(create_material(mesh.name))
    primitive = Primitive(attributes=attributes, indices=indices, material=len(gltf.materials) - 1)
    gltf.meshes.append(GltfMesh(name=mesh.name, primitives=[primitive]))
    bind = _add(gltf, blob, _columns(skin.inverse_bind))
    gltf.skins.append(GltfSkin(name=mesh.name, joints=skin.joints.tolist(), inverseBindMatrices=bind))
    gltf.nodes.append(Node(name=mesh.name, mesh=len(gltf.meshes) - 1, skin=len(gltf.skins) - 1))


def _columns(matrices: Floats) -> NDArray[np.float32]:
    """Affine (J, 3, 4) as 4 × 4 matrices (J, 16) in column-major order."""
    whole = np.zeros((len(matrices), 4, 4))
    whole[:, :3], whole[:, 3, 3] = matrices, 1.0
    return whole.transpose(0, 2, 1).reshape(-1, 16).astype("<f4")


def _add(gltf: GLTF2, blob: bytearray, rows: AnyArray, target: int | None = None, *, bounds: bool = False) -> int:
    """Append rows (n, C) to the blob and return the index of their accessor."""
    data = np.ascontiguousarray(rows).tobytes()
    offset = len(blob)
    blob += data + bytes(-len(data) % 4)
    return add_accessor(gltf, rows, offset=offset, length=len(data), target=target, bounds=bounds)


def _document(gltf: GLTF2, blob: bytes, skeleton: Skeleton) -> Document:
    """The document with the nodes of the skeleton, validated like any other file."""
    from pygltflib import Buffer as GltfBuffer

    data = np.frombuffer(blob, np.uint8)
    buffers = [Buffer(len(blob), None, lambda: data)] if blob else []
    gltf.buffers += [GltfBuffer(byteLength=buffer.byte_length) for buffer in buffers]
    content = json_text.parse(gltf.to_json().encode())
    if len(skeleton):
        content = _insert_nodes(content, skeleton)
    return container.check_edits(Document(content, tuple(buffers)))
