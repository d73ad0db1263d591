"""Files with Draco meshes for tests, made with DracoPy's own encoder: no blobs in git."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import DracoPy
import numpy as np
from numpy.typing import NDArray

from anim.gltf.document import Buffer, Document
from anim.gltf.io import json_text
from anim.gltf.reading.accessors import Accessors

EXTENSION = "KHR_draco_mesh_compression"
BITS = 20  # of positions
POSITION = 0  # Draco's type of that attribute
DATA = "data:application/octet-stream;base64,"  # what a buffer is written as


def compressed(document: Document) -> Document:
    """Return the document with every primitive's vertices and faces as Draco data in a buffer of its own."""
    content: dict[str, Any] = json.loads(json_text.dump(document.json))
    accessors = Accessors(document)
    for mesh in content["meshes"]:
        for primitive in mesh["primitives"]:
            data = _encoded(primitive, accessors)
            content["buffers"].append({"byteLength": len(data)})
            content["bufferViews"].append({"buffer": len(content["buffers"]) - 1, "byteLength": len(data)})
            numbers = dict(_numbers(primitive, data))
            primitive["extensions"] = {
                EXTENSION: {"bufferView": len(content["bufferViews"]) - 1, "attributes": numbers}
            }
            document = _with_buffer(document, data)
            for number in (*(primitive["attributes"][name] for name in numbers), primitive["indices"]):
                for key in ("bufferView", "byteOffset"):
                    content["accessors"][number].pop(key, None)
    for key in ("extensionsUsed", "extensionsRequired"):
        content[key] = [*content.get(key, []), EXTENSION]
    return Document(content, document.buffers)


def _encoded(primitive: dict[str, Any], accessors: Accessors) -> bytes:
    arrays: dict[str, NDArray[Any]] = {name: accessors.raw(n) for name, n in primitive["attributes"].items()}
    others = {i: np.ascontiguousarray(arrays[name]) for i, name in enumerate(_generic(primitive))}
    data: bytes = DracoPy.encode(
        arrays["POSITION"],
        accessors.raw(primitive["indices"]).reshape(-1, 3).astype(np.uint32),
        quantization_bits=BITS,
        preserve_order=True,
        generic_attributes=others or None,
    )
    return data


def _generic(primitive: dict[str, Any]) -> list[str]:
    return [name for name in primitive["attributes"] if name.startswith(("JOINTS", "WEIGHTS"))]


def _numbers(primitive: dict[str, Any], data: bytes) -> Iterator[tuple[str, int]]:
    """Unique ids in the data by the attribute's name."""
    yield from ((name, i) for i, name in enumerate(_generic(primitive)))
    for each in DracoPy.decode(data).attributes:
        if each["attribute_type"] == POSITION:
            yield "POSITION", each["unique_id"]


def _with_buffer(document: Document, data: bytes) -> Document:
    stored = np.frombuffer(data, np.uint8)
    return Document(document.json, (*document.buffers, Buffer(len(data), DATA, lambda: stored, replaced=True)))
