"""A file with everything that a bake must not touch, as bytes of a GLB.

A skinned strip of two primitives with a material each (base color, KHR_texture_transform, normal map, unlit variant),
texture coordinates in two sets, colors, a `_WEAR` attribute, extras and an extension that nobody knows; a camera on a
node below a joint; a rigid mesh that a clip moves; points without a material; two clips.
"""

from __future__ import annotations

import io
import json
import struct
from typing import Any

import numpy as np

from anim.arrays import AnyArray
from anim.gltf.document import Document
from anim.gltf.io import container

UNKNOWN = "ACME_weathering"
COLUMNS = 9  # pairs of vertices of the strip


def image(corner: tuple[int, int, int]) -> bytes:
    """Return a PNG: its upper left quarter in one color, the others blue, white and gray."""
    from PIL import Image

    pixels = np.full((8, 8, 3), 128, np.uint8)
    pixels[:4, :4], pixels[:4, 4:], pixels[4:, :4] = corner, (0, 0, 255), (255, 255, 255)
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG")
    return file.getvalue()


def textured() -> bytes:
    """Return the file."""
    made = _Maker()
    strip = made.strip()
    primitives = [
        {**strip, "indices": made.faces(0), "material": 0, "extras": {"part": "front"}},
        {
            **strip,
            "indices": made.faces(1),
            "material": 1,
            "extensions": {"KHR_materials_variants": {"mappings": [{"material": 0, "variants": [0]}]}},
        },
    ]
    flat = made.add(np.array([[0, 0, 0], [0.2, 0, 0], [0, 0.2, 0]], "<f4"), bounds=True)
    made.json |= {
        "meshes": [
            {"name": "strip", "primitives": primitives, "extras": {"of": "strip"}},
            {"name": "flag", "primitives": [{"attributes": {"POSITION": flat}, "mode": 4}]},
            {"name": "dust", "primitives": [{"attributes": {"POSITION": flat}, "mode": 0}]},
        ],
        "nodes": [
            {"name": "world", "children": [1, 4, 5, 6]},
            {"name": "low", "children": [2]},
            {"name": "high", "translation": [0, 1, 0], "children": [3]},
            {"name": "lens", "camera": 0},
            {"name": "body", "mesh": 0, "skin": 0, "translation": [5, 5, 5], "extras": {"keep": [1]}},
            {"name": "flag", "mesh": 1},
            {"name": "dust", "mesh": 2, "extensions": {UNKNOWN: {"dust": 0.5}}},
        ],
        "skins": [{"joints": [1, 2], "inverseBindMatrices": made.binds()}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}],
        "animations": [made.clip("bend", 80), made.clip("other", 20)],
    }
    return made.glb()


class _Maker:
    def __init__(self) -> None:
        self.data = bytearray()
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0", "copyright": "nobody"},
            "extensionsUsed": ["KHR_texture_transform", "KHR_materials_variants", UNKNOWN],
            "extensions": {
                "KHR_materials_variants": {"variants": [{"name": "plain"}]},
                UNKNOWN: {"rain": {"strength": 0.25}, "name": "storm"},
            },
            "extras": {"project": "x"},
            "scene": 0,
            "scenes": [{"name": "stage", "nodes": [0]}],
            "bufferViews": [],
            "accessors": [],
            "samplers": [{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}],
        }
        self.json["images"] = [
            {"bufferView": self.view(image((255, 0, 0))), "mimeType": "image/png", "name": "red"},
            {"bufferView": self.view(image((0, 255, 0))), "mimeType": "image/png"},
        ]
        self.json["textures"] = [{"source": 0, "sampler": 0}, {"source": 1}]
        transform = {"KHR_texture_transform": {"offset": [0.1, 0.2], "rotation": 0.3, "scale": [2, 0.5], "texCoord": 1}}
        self.json["materials"] = [
            {
                "name": "red",
                "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0.0},
                "normalTexture": {"index": 1, "scale": 0.5},
                "doubleSided": True,
            },
            {
                "name": "green",
                "pbrMetallicRoughness": {
                    "baseColorTexture": {"index": 1, "extensions": transform},
                    "baseColorFactor": [1, 1, 1, 0.5],
                },
                "alphaMode": "MASK",
                "extensions": {UNKNOWN: {"rust": [0.5, 1.5]}},
            },
        ]

    def view(self, data: bytes, **more: int) -> int:
        self.data += bytes(-len(self.data) % 4)
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **more})
        self.data += data
        return len(self.json["bufferViews"]) - 1

    def add(self, rows: AnyArray, *, bounds: bool = False, normalized: bool = False, target: int = 34962) -> int:
        kinds = {"<f4": 5126, "<u2": 5123, "|u1": 5121}
        about: dict[str, Any] = {
            "bufferView": self.view(rows.tobytes(), **({"target": target} if target else {})),
            "componentType": kinds[rows.dtype.str],
            "count": len(rows),
            "type": {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}[rows.shape[1]],
        }
        if normalized:
            about["normalized"] = True
        if bounds:
            about |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.json["accessors"].append(about)
        return len(self.json["accessors"]) - 1

    def strip(self) -> dict[str, Any]:
        """Vertices of a strip from y = 0 to 2."""
        y = np.repeat(np.linspace(0, 2, COLUMNS), 2)
        x = np.tile([0.0, 1.0], COLUMNS)
        count = len(y)
        zero, one = np.zeros(count), np.ones(count)
        high = np.clip(y - 0.5, 0, 1)
        attributes = {
            "POSITION": self.add(np.stack((x, y, zero), axis=1).astype("<f4"), bounds=True),
            "NORMAL": self.add(np.stack((zero, zero, one), axis=1).astype("<f4")),
            "TANGENT": self.add(np.stack((one, zero, zero, one), axis=1).astype("<f4")),
            "TEXCOORD_0": self.add(np.stack((x, 1 - y / 2), axis=1).astype("<f4")),
            "TEXCOORD_1": self.add((np.stack((x, y / 2), axis=1) * 65535).astype("<u2"), normalized=True),
            "COLOR_0": self.add(np.stack((one, y / 2, one, one), axis=1).astype("<f4")),
            "_WEAR": self.add(y[:, None].astype("<f4")),
            "JOINTS_0": self.add(np.stack((zero, high > 0, zero, zero), axis=1).astype("u1")),
            "WEIGHTS_0": self.add(np.stack((1 - high, high, zero, zero), axis=1).astype("<f4")),
        }
        return {"attributes": attributes}

    def faces(self, half: int) -> int:
        """Triangles of the lower or of the upper half of the strip."""
        first = np.arange(4 * half, 4 * half + 4)[:, None] * 2
        corners = np.concatenate((first + np.array([0, 1, 2]), first + np.array([2, 1, 3])))
        return self.add(corners.reshape(-1, 1).astype("<u2"), target=34963)

    def binds(self) -> int:
        back = np.eye(4)
        back[1, 3] = -1
        return self.add(np.stack((np.eye(4).T, back.T)).reshape(2, 16).astype("<f4"), target=0)

    def clip(self, name: str, degrees: float) -> dict[str, Any]:
        """The upper joint bends and the flag flies, in a second."""
        times = self.add(np.linspace(0, 1, 5)[:, None].astype("<f4"), bounds=True, target=0)
        half = np.radians(degrees) / 2 * np.array([0, 0.6, 1, 0.6, 0])
        zero = np.zeros(5)
        turns = self.add(np.stack((np.sin(half), zero, zero, np.cos(half)), axis=1).astype("<f4"), target=0)
        moves = self.add(np.stack((zero, np.linspace(0, 1, 5), zero), axis=1).astype("<f4"), target=0)
        return {
            "name": name,
            "extras": {"clip": name},
            "samplers": [{"input": times, "output": turns}, {"input": times, "output": moves}],
            "channels": [
                {"sampler": 0, "target": {"node": 2, "path": "rotation"}},
                {"sampler": 1, "target": {"node": 5, "path": "translation"}},
                {"sampler": 1, "target": {"node": 4, "path": "translation"}},
            ],
        }

    def glb(self) -> bytes:
        self.json["buffers"] = [{"byteLength": len(self.data)}]
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        data = bytes(self.data) + bytes(-len(self.data) % 4)
        head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data))
        return head + struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data


def looks(document: Document) -> dict[str, Any]:
    """Return everything that a bake keeps: materials, images, and the bytes of attributes and indices of each mesh."""
    from anim.gltf.reading.accessors import Accessors
    from anim.gltf.reading.materials import image_data

    accessors = Accessors(document)
    json = document.json
    found = {
        key: json.get(key) for key in ("asset", "materials", "textures", "samplers", "extensions", "extras", "cameras")
    }
    found["images"] = [
        (
            {key: value for key, value in each.items() if key != "bufferView"},
            image_data(document, i, accessors).tobytes(),
        )
        for i, each in enumerate(json.get("images", ()))
    ]
    found["meshes"] = [
        (
            {key: value for key, value in mesh.items() if key in ("name", "extensions")},
            {key: value for key, value in mesh.get("extras", {}).items() if key != "targetNames"},
            [_primitive(accessors, each) for each in mesh["primitives"]],
        )
        for mesh in json["meshes"]
    ]
    return found


def _primitive(accessors: Any, primitive: dict[str, Any]) -> dict[str, Any]:
    kept = {
        name: accessors.raw(index)
        for name, index in primitive["attributes"].items()
        if name.startswith(("TEXCOORD", "COLOR", "_"))
    }
    rest = {key: primitive.get(key) for key in ("material", "mode", "extras", "extensions")}
    indices = accessors.raw(primitive["indices"]).tobytes() if "indices" in primitive else b""
    about = {name: (str(rows.dtype), rows.tobytes()) for name, rows in kept.items()}
    return {**rest, "indices": indices, "attributes": about}


def opened(data: bytes) -> Document:
    """Return the document in a GLB."""
    return container.read(data)


def without_losses(data: Document) -> Document:
    """Return a document without what UsdPreviewSurface lacks: vertex colors, scales of normal maps, texture filters.

    The colors of one real file are black.
    """
    for mesh in data.json["meshes"]:
        for primitive in mesh["primitives"]:
            primitive["attributes"].pop("COLOR_0", None)
    for material in data.json.get("materials", ()):
        material.get("normalTexture", {}).pop("scale", None)
    for sampler in data.json.get("samplers", ()):
        sampler.pop("magFilter", None)
    return data
