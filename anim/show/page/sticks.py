"""Sticks from joint to joint for a document without any mesh."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain

import numpy as np

from anim.exchange.split_skins import split_by_root
from anim.exchange.stick_mesh import stick_mesh
from anim.gltf.document import Document, Json, json_array
from anim.gltf.reading import reader
from anim.gltf.writing.append import Contents, append_accessors, append_nodes, mesh_accessors
from anim.model import Mesh, Skeleton, Skin

MAX_JOINTS_OF_BYTES = 256
MAX_MESHES = 100  # which three.js draws one by one; it takes skins without a common root too
ATTRIBUTES = ("indices", "POSITION", "NORMAL", "JOINTS_0", "WEIGHTS_0", "inverseBindMatrices")  # of each mesh, in order
MATERIAL: Json = {
    "name": "sticks",
    "pbrMetallicRoughness": {"baseColorFactor": [0.7, 0.7, 0.7, 1.0], "metallicFactor": 0.0},
}


def add_sticks(document: Document) -> Document:
    """Return a document with sticks skinned to its nodes, after everything it has; itself without two nodes."""
    skeleton = reader.skeleton(document)
    if len(skeleton) < 2:
        return document
    split = split_by_root(skeleton, *stick_mesh(skeleton, _ends(skeleton)), max_meshes=MAX_MESHES)
    bodies = [(mesh, skin) for mesh, skin in split if len(mesh.positions)]
    if not bodies:
        return document
    contents = list(chain.from_iterable(_contents(*each) for each in bodies))
    document, indices = append_accessors(document, contents)  # in one call: each copies all bytes
    json = dict(document.json)
    materials, meshes, skins = ([*json_array(json, key)] for key in ("materials", "meshes", "skins"))
    nodes: list[Json] = []
    for (mesh, skin), first in zip(bodies, range(indices[0], indices[-1] + 1, len(ATTRIBUTES)), strict=True):
        attributes = dict(zip(ATTRIBUTES, range(first, first + len(ATTRIBUTES)), strict=True))
        held, bind = attributes.pop("indices"), attributes.pop("inverseBindMatrices")
        primitive = {"attributes": attributes, "indices": held, "material": len(materials)}
        nodes.append({"name": mesh.name, "mesh": len(meshes), "skin": len(skins)})
        materials.append(MATERIAL)
        meshes.append({"name": mesh.name, "primitives": [primitive]})
        skins.append({"joints": skin.joints.tolist(), "inverseBindMatrices": bind})
    json |= {"materials": materials, "meshes": meshes, "skins": skins}
    return append_nodes(replace(document, json=json), nodes)[0]


def _contents(mesh: Mesh, skin: Skin) -> Contents:
    """Rows of the accessors of ATTRIBUTES, and the targets of their buffer views."""
    joints = mesh.joints.astype("<u2" if len(skin.joints) > MAX_JOINTS_OF_BYTES else "<u1")
    return [
        *mesh_accessors(mesh.positions, mesh.faces, mesh.normals),
        (joints, None),
        (mesh.weights.astype("<f4"), None),
        (_columns(skin), None),
    ]


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
