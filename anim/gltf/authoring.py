"""Create a Document from a skeleton, clips and skinned meshes, with pygltflib."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from anim.arrays import AnyArray, Floats
from anim.gltf.authoring_parts import INDICES, VERTICES, add_accessor, create_document, create_material
from anim.gltf.document import Document, Json, json_array
from anim.gltf.io import container
from anim.gltf.writing import writer
from anim.model import Clip, Mesh, Skeleton, Skin

if TYPE_CHECKING:
    from pygltflib import GLTF2


def build_document(skeleton: Skeleton, clips: Sequence[Clip], bodies: Sequence[tuple[Mesh, Skin]] = ()) -> Document:
    """Return a new document with the nodes of the skeleton, one node per body, and the clips.

    Node indices are those of the skeleton, which the clips and skins use. TRS properties equal to the identity are
    omitted. bodies: a mesh and its skin; the joints of the mesh are indices into the skin's joints.
    """
    from pygltflib import Node

    gltf = create_document()
    for number, name in enumerate(skeleton.names):
        gltf.nodes.append(Node(name=name or None, **_transform_json(skeleton, number)))
    for number, parent in enumerate(skeleton.parents.tolist()):
        (gltf.scenes[0].nodes if parent < 0 else gltf.nodes[parent].children).append(number)
    blob = bytearray()
    for mesh, skin in bodies:
        _add_body(gltf, blob, mesh, skin)
    return add_clips(_document(gltf, bytes(blob)), clips)


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


def _transform_json(skeleton: Skeleton, number: int) -> dict[str, list[float]]:
    parts = {
        "translation": (skeleton.translation[number], (0.0, 0.0, 0.0)),
        "rotation": (skeleton.rotation[number], (0.0, 0.0, 0.0, 1.0)),
        "scale": (skeleton.scale[number], (1.0, 1.0, 1.0)),
    }
    return {
        key: (np.round(value, 9) + 0.0).tolist()
        for key, (value, none) in parts.items()
        if not np.array_equal(value, none)
    }


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
    gltf.scenes[0].nodes.append(len(gltf.nodes) - 1)


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


def _document(gltf: GLTF2, blob: bytes) -> Document:
    """The document, read back with `container.read`, so that it is validated like any other file."""
    from pygltflib import Buffer

    data = gltf.to_json().encode()
    if blob:
        gltf.buffers.append(Buffer(byteLength=len(blob)))
        gltf.set_binary_blob(blob)
        data = b"".join(bytes(piece) for piece in gltf.save_to_bytes())
    return container.read(np.frombuffer(data, np.uint8))
