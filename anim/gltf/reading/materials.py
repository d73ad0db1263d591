"""Materials → base color: factor, texture and alpha mode only; bytes of images."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from anim.arrays import Floats
from anim.errors import FormatError
from anim.gltf.document import Bytes, Document, Json, json_array
from anim.gltf.io import uri
from anim.gltf.io.buffers import Resolve
from anim.gltf.reading.accessors import Accessors
from anim.gltf.validation.rules import Check, ObjectRule, at_least, numbers, text

REPEAT, CLAMP_TO_EDGE, MIRRORED_REPEAT = 10497, 33071, 33648  # wrap modes of samplers
NEAREST = 9728
WHITE = (1.0, 1.0, 1.0, 1.0)
DEFAULT_ALPHA_CUTOFF = 0.5  # of MASK without a cutoff (glTF 2.0, 3.9.4)
TRANSFORM, WEBP, BASISU = "KHR_texture_transform", "EXT_texture_webp", "KHR_texture_basisu"


@dataclass(frozen=True, slots=True)
class Texture:
    """A base color texture. image: its index in the file. texcoord: n of TEXCOORD_n.

    wrap: modes along u and v. nearest: True if texels are magnified without interpolation. transform: (2, 3), from the
    file's texture coordinates (u, v, 1) to the sampled ones.
    """

    image: int
    texcoord: int
    wrap: tuple[int, int]
    nearest: bool
    transform: Floats


@dataclass(frozen=True, slots=True)
class Material:
    """The base color of a surface. factor: linear RGBA. alpha_mode: OPAQUE, MASK or BLEND."""

    factor: tuple[float, float, float, float] = WHITE
    texture: Texture | None = None
    alpha_mode: str = "OPAQUE"
    alpha_cutoff: float = DEFAULT_ALPHA_CUTOFF


def read_materials(document: Document, note: Callable[[str], None] = lambda _: None) -> tuple[Material, ...]:
    """Return the materials of a file in its order; invalid ones are opaque white, or untextured.

    note: called with a line for each unsupported property.
    """
    found = []
    for i, about in enumerate(json_array(document.json, "materials")):
        try:
            material, info = _material(about)
        except FormatError as error:
            note(f"{error.at(f'material {i}', ': ')}: drawn without it")
            material, info = Material(), None
        try:
            found.append(material if info is None else replace(material, texture=_texture(document.json, info)))
        except FormatError as error:
            note(f"{error.at(f'texture of material {i}', ': ')}: drawn without it")
            found.append(material)
    return tuple(found)


def _check_number(value: Any) -> None:
    numbers(1)([value])


_TEXTURE_INFO = ObjectRule({"index": at_least(0), "texCoord": at_least(0), "extensions": ObjectRule({})}, ("index",))
_SURFACE: dict[str, Check] = {"baseColorFactor": numbers(4), "baseColorTexture": _TEXTURE_INFO}
_MATERIAL = ObjectRule(
    {
        "pbrMetallicRoughness": ObjectRule(_SURFACE),
        "alphaMode": text,
        "alphaCutoff": _check_number,
        "extensions": ObjectRule({}),
    }
)
_TRANSFORM = ObjectRule({"offset": numbers(2), "rotation": _check_number, "scale": numbers(2), "texCoord": at_least(0)})
_SOURCE = ObjectRule({"source": at_least(0)}, ("source",))


def _material(about: Json) -> tuple[Material, Json | None]:
    """A material without its texture, and the JSON of its texture."""
    _MATERIAL(about)
    surface = about.get("pbrMetallicRoughness", {})
    factor = tuple(float(each) for each in surface.get("baseColorFactor", WHITE))
    cutoff = float(about.get("alphaCutoff", DEFAULT_ALPHA_CUTOFF))
    material = Material((factor[0], factor[1], factor[2], factor[3]), None, about.get("alphaMode", "OPAQUE"), cutoff)
    return material, surface.get("baseColorTexture")


def _texture(json: Json, info: Json) -> Texture:
    texture = _item(json, "textures", info["index"])
    sampler = _item(json, "samplers", texture["sampler"]) if "sampler" in texture else {}
    transform = info.get("extensions", {}).get(TRANSFORM, {})
    _TRANSFORM(transform)
    return Texture(
        _image(json, texture),
        transform.get("texCoord", info.get("texCoord", 0)),
        (sampler.get("wrapS", REPEAT), sampler.get("wrapT", REPEAT)),
        sampler.get("magFilter") == NEAREST,
        _matrix(transform),
    )


def _image(json: Json, texture: Json) -> int:
    """Index of a decodable image: WebP of the extension, else the core source."""
    extensions = texture.get("extensions", {})
    ObjectRule({WEBP: _SOURCE, BASISU: _SOURCE})(extensions)
    named = extensions.get(WEBP, texture)
    if "source" not in named:
        raise FormatError("is KTX2, which is not decoded" if BASISU in extensions else "has no image")
    _SOURCE(named)
    _item(json, "images", named["source"])
    return int(named["source"])


def _matrix(transform: Json) -> Floats:
    """Scale, then rotation counter-clockwise for v pointing down, then offset."""
    (x, y), (across, down) = transform.get("offset", (0, 0)), transform.get("scale", (1, 1))
    rotation = transform.get("rotation", 0)
    cosine, sine = math.cos(rotation), math.sin(rotation)
    return np.array([[across * cosine, down * sine, x], [-across * sine, down * cosine, y]])


def _item(json: Json, key: str, index: Any) -> Json:
    found = json_array(json, key)
    if type(index) is not int or not 0 <= index < len(found) or not isinstance(found[index], dict):
        raise FormatError(f"uses {key}[{index}] (the file has {len(found)})")
    return found[index]


def image_data(document: Document, index: int, accessors: Accessors, resolve: Resolve | None = None) -> Bytes:
    """Return the encoded bytes of an image.

    resolve: returns the bytes of a file in the input's folder by its relative path; None if the input has no folder.
    Raises FormatError if they cannot be read.
    """
    image = json_array(document.json, "images")[index]
    if "bufferView" in image:
        return accessors.view(image["bufferView"])
    address = image.get("uri", "")
    if uri.is_data(address):
        return np.frombuffer(uri.decode_data(address, uri.IMAGE_TYPES), np.uint8)
    path = uri.relative_path(address)
    if resolve is None:
        raise FormatError(f"'{path}' lies beside the file, which has no folder")
    found = resolve(path)
    return found if isinstance(found, np.ndarray) else np.frombuffer(found, np.uint8)
