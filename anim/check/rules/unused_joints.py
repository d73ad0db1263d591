"""GA213: joints that move no vertex."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from anim.arrays import Floats, Ints
from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.influences import DRACO, edit_influences
from anim.check.rule import Fix, Parameters, Rule
from anim.gltf.document import Document, json_array
from anim.gltf.reading.accessors import Accessors
from anim.measure.inspect.inspect import useful_joints


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the skins."""
    for skin in file.facts.skins:
        if skin.unused_joints:
            problem = f"{skin.unused_joints} of {skin.joints} joints move no vertex"
            yield file.in_skin(skin.index, skin.unused_joints, problem=problem)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document without these joints in skins; their nodes stay."""
    skins = {each.number: _kept(file, each.number) for each in found}
    skins = {skin: kept for skin, kept in skins.items() if kept}

    def renumbered(skin: int, joints: Ints, weights: Floats) -> tuple[Ints, Floats]:
        new = np.zeros(len(file.json["skins"][skin]["joints"]), np.int64)
        new[skins[skin]] = np.arange(len(skins[skin]))
        return np.where(weights > 0, new[np.minimum(joints, len(new) - 1)], 0), weights

    document = edit_influences(file, set(skins), renumbered)
    return document if document is file.document else _with_joints(file, document, skins)


def _kept(file: CheckedFile, skin: int) -> list[int]:
    """Indices in a skin of the joints that stay, [] if other skins use its meshes too."""
    nodes, joints = json_array(file.json, "nodes"), file.json["skins"][skin]["joints"]
    meshes = {node["mesh"] for node in nodes if node.get("skin") == skin and "mesh" in node}
    alone = all(node.get("skin") == skin for node in nodes if node.get("mesh") in meshes)
    plain = not any(
        DRACO in p.get("extensions", {}) for mesh in meshes for p in file.json["meshes"][mesh]["primitives"]
    )
    using = [each for each in file.scene.instances if nodes[each.node].get("skin") == skin]
    useful = useful_joints(using, joints, file.skeleton)
    return [i for i, joint in enumerate(joints) if joint in useful] if alone and plain else []


def _with_joints(file: CheckedFile, document: Document, skins: Mapping[int, list[int]]) -> Document:
    """The document with the joints of skins at these indices only, and their matrices."""
    from anim.gltf.writing.append import append_accessors  # only fixes write
    from anim.gltf.writing.removal import remove_unused_accessors

    about = [*document.json["skins"]]
    replaced = set()
    for skin, kept in skins.items():
        about[skin] = {**about[skin], "joints": [about[skin]["joints"][i] for i in kept]}
        if "inverseBindMatrices" in about[skin]:
            old = about[skin]["inverseBindMatrices"]
            rows = Accessors(document).floats(old)[kept].astype("<f4")
            document, (accessor,) = append_accessors(document, [(rows, None)])
            about[skin]["inverseBindMatrices"] = accessor
            replaced.add(old)
    document = replace(document, json={**document.json, "skins": about})
    return remove_unused_accessors(document, replaced)


RULE = Rule(
    "GA213",
    "unused-joints",
    Severity.INFO,
    "A skin has joints that move no vertex.",
    "They cost a matrix per frame, and bytes if they are animated.",
    find,
    advice="if nothing is attached to them, leave them out where the skin is made",
    fix=Fix("remove them from the skin; their nodes stay", fix, is_safe=False),
)
