"""Replace Draco data by plain accessors."""

from __future__ import annotations

from collections.abc import Collection

from anim.gltf.document import Document, Json, copy_json, json_array
from anim.gltf.reading import draco
from anim.gltf.reading.accessors import Accessors
from anim.gltf.validation.buffer_layout import DRACO
from anim.gltf.writing.append import INDICES, MAX_UINT16, VERTICES
from anim.gltf.writing.new_accessors import NewAccessors, edit_document


def decode_draco(document: Document, meshes: Collection[int]) -> Document:
    """Return the document with the Draco data of meshes decoded; itself if they have none.

    Raises UnsupportedError without the package DracoPy.
    """
    if not any(
        DRACO in each.get("extensions", {}) for i in meshes for each in document.json["meshes"][i]["primitives"]
    ):
        return document
    json, new = copy_json(document.json), NewAccessors(len(json_array(document.json, "accessors")))
    for mesh in meshes:
        for primitive in json["meshes"][mesh]["primitives"]:
            if DRACO in primitive.get("extensions", {}):
                _decode(document, primitive, new)
    if not any(map(_has_draco, json["meshes"])):
        for key in ("extensionsUsed", "extensionsRequired"):
            json[key] = [name for name in json.get(key, []) if name != DRACO]
            if not json[key]:
                del json[key]
    return edit_document(document, json, new)


def _has_draco(mesh: Json) -> bool:
    return any(DRACO in each.get("extensions", {}) for each in mesh["primitives"])


def _decode(document: Document, primitive: Json, new: NewAccessors) -> None:
    """Decode a primitive in place."""
    accessors, faces = draco.read_primitive(
        primitive, Accessors(document), views=len(json_array(document.json, "bufferViews"))
    )
    attributes = primitive["attributes"]
    for name in primitive["extensions"][DRACO]["attributes"]:
        if name in attributes:
            rows, about = accessors.raw(attributes[name]), accessors.about(attributes[name])
            normalized = bool(about.get("normalized"))
            attributes[name] = new.add(rows, target=VERTICES, normalized=normalized, bounds=name == "POSITION")
    if len(faces):
        index_type = "<u2" if len(rows) <= MAX_UINT16 else "<u4"
        primitive["indices"] = new.add(faces.reshape(-1, 1).astype(index_type), target=INDICES)
        primitive.pop("mode", None)
    del primitive["extensions"][DRACO]
    if not primitive["extensions"]:
        del primitive["extensions"]
