"""Sticks from joint to joint for a document without any mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anim.exchange.split_skins import split_by_root
from anim.exchange.stick_mesh import stick_mesh
from anim.gltf.document import Document, Json, json_array
from anim.gltf.reading import reader
from anim.gltf.writing.append import append_accessors, append_mesh, append_nodes
from anim.model import Mesh, Skeleton, Skin

MAX_JOINTS_OF_BYTES = 256
MATERIAL: Json = {
    "name": "sticks",
    "pbrMetallicRoughness": {"baseColorFactor": [0.7, 0.7, 0.7, 1.0], "metallicFactor": 0.0},
}


def add_sticks(document: Document) -> Document:
    """Return a document with sticks skinned to its nodes, after everything it has; itself without two nodes."""
    skeleton = reader.skeleton(document)
    if len(skeleton) < 2:
        return document
    for mesh, skin in split_by_root(skeleton, *stick_mesh(skeleton, _ends(skeleton))):
        if len(mesh.positions):
            document = _append(document, mesh, skin)
    return document


def _append(document: Document, mesh: Mesh, skin: Skin) -> Document:
    document, number = append_mesh(document, mesh.name, mesh.positions, mesh.faces, mesh.normals, MATERIAL)
    joints = mesh.joints.astype("<u2" if len(skin.joints) > MAX_JOINTS_OF_BYTES else "<u1")
    document, (held, weights, bind) = append_accessors(
        document, [(joints, None), (mesh.weights.astype("<f4"), None), (_columns(skin), None)]
    )
    json = dict(document.json)
    primitive = json["meshes"][number]["primitives"][0]
    attributes = {**primitive["attributes"], "JOINTS_0": held, "WEIGHTS_0": weights}
    meshes = [*json["meshes"]]
    meshes[number] = {**meshes[number], "primitives": [{**primitive, "attributes": attributes}]}
    skins = [*json_array(json, "skins"), {"joints": skin.joints.tolist(), "inverseBindMatrices": bind}]
    document = replace(document, json={**json, "meshes": meshes, "skins": skins})
    return append_nodes(document, [{"name": mesh.name, "mesh": number, "skin": len(skins) - 1}])[0]


def _columns(skin: Skin) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    """Inverse bind matrices (J, 16), column-major."""
    whole = np.zeros((len(skin.joints), 4, 4))
    whole[:, :3], whole[:, 3, 3] = skin.inverse_bind, 1.0
    return whole.transpose(0, 2, 1).reshape(-1, 16).astype("<f4")


def _ends(skeleton: Skeleton) -> frozenset[int]:
    """Nodes without a stick: those that end their parent's, and single ones beside a skeleton, such as a target."""
    parents = set(skeleton.parents.tolist())
    leaves = [i for i in range(len(skeleton)) if i not in parents]
    has_bones = len(leaves) < len(skeleton)
    return frozenset(i for i in leaves if skeleton.parents[i] >= 0 or has_bones)
