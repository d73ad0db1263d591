"""Joints and weights of skinned vertices, replaced for fixes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import zip_longest

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Floats, Ints
from anim.check.checked_file import CheckedFile
from anim.gltf.document import Document, Json, copy_json, json_array

DRACO = "KHR_draco_mesh_compression"
MAX_UINT8 = 255
Edit = Callable[[int, Ints, Floats], tuple[Ints, Floats]]  # of a skin: joints and weights (V, I), as stored


def edit_influences(file: CheckedFile, skins: set[int], edit: Edit) -> Document:
    """Return the document with edited joints and weights of the vertices of these skins.

    Accessors that several primitives of a skin use are edited once for it. Vertices that Draco compresses, and meshes
    of other skins too, keep theirs. Weights are written as float32; those that `edit` returns as they are stay.
    """
    from anim.gltf.writing.removal import remove_unused_accessors  # only fixes write

    document = replace(file.document, json=copy_json(file.json))
    done: dict[tuple[int, ...], dict[str, int | None]] = {}
    replaced: set[int] = set()
    for skin, primitive in _primitives(document.json, skins):
        attributes = primitive["attributes"]
        names = _names(attributes)
        old = tuple(attributes[name] for name in names)
        key = (skin, *old)  # other skins may have other joints at the same indices
        if key not in done:
            joints = np.concatenate([file.contents.accessors.indices(i) for i in old[::2]], axis=1)
            weights = np.concatenate([file.contents.accessors.floats(i) for i in old[1::2]], axis=1)
            document, done[key] = _append(document, weights, edit(skin, joints, weights))
            replaced |= set(old)
        kept = {name: attributes.pop(name) for name in names}
        attributes.update({name: kept[name] if index is None else index for name, index in done[key].items()})
    return remove_unused_accessors(document, replaced) if done else file.document


def _primitives(json: Json, skins: set[int]) -> Iterator[tuple[int, Json]]:
    """Yield skin and JSON of the primitives that only these skins use."""
    users: dict[int, set[int]] = {}
    for node in json_array(json, "nodes"):
        if "mesh" in node:
            users.setdefault(node["mesh"], set()).add(node.get("skin", -1))
    for mesh, using in users.items():
        if len(using) == 1 and using <= skins:
            for primitive in json["meshes"][mesh]["primitives"]:
                if DRACO not in primitive.get("extensions", {}) and "JOINTS_0" in primitive["attributes"]:
                    yield min(using), primitive


def _names(attributes: Json) -> list[str]:
    """Names of the attributes of all sets in order: JOINTS_0, WEIGHTS_0, JOINTS_1 …"""
    names: list[str] = []
    while f"JOINTS_{len(names) // 2}" in attributes and f"WEIGHTS_{len(names) // 2}" in attributes:
        names += [f"JOINTS_{len(names) // 2}", f"WEIGHTS_{len(names) // 2}"]
    return names


def _append(document: Document, old: Floats, edited: tuple[Ints, Floats]) -> tuple[Document, dict[str, int | None]]:
    """The document with accessors for joints and weights (V, 4n), and their indices by attribute.

    old: the weights before; if they are returned, their attributes get None and keep their accessors.
    """
    from anim.gltf.writing.append import VERTICES, append_accessors

    joints, weights = edited
    stored = joints.astype("u1" if joints.max(initial=0) <= MAX_UINT8 else "<u2")
    parts = [slice(k, k + 4) for k in range(0, joints.shape[1], 4)]
    contents: list[tuple[NDArray[np.generic], int | None]] = [(stored[:, part], VERTICES) for part in parts]
    if weights is not old:
        contents += [(weights[:, part].astype("<f4"), VERTICES) for part in parts]
    document, indices = append_accessors(document, contents)
    names = [f"{name}_{k}" for name in ("JOINTS", "WEIGHTS") for k in range(len(parts))]
    return document, dict(zip_longest(names, indices))
