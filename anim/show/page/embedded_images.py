"""Images of a document as views of its one buffer; materials without those that a browser cannot draw."""

from __future__ import annotations

import base64
from collections.abc import Collection, Iterator
from typing import Any

import numpy as np

from anim.arrays import Bytes
from anim.errors import AnimError, FormatError
from anim.gltf.document import Document, Json, json_array
from anim.gltf.io.buffers import Resolve
from anim.gltf.io.images import HEAD_BYTES, media_type
from anim.gltf.reading.accessors import Accessors
from anim.gltf.reading.materials import BASISU, WEBP, image_data
from anim.show.page.packing import Packing
from anim.units import FEW, list_some, plural

DRAWN = ("image/png", "image/jpeg", "image/webp", "image/avif")
PREFERRED = (WEBP, "EXT_texture_avif")  # instead of a texture's own source
WHITE_PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEAsTj2FAAAAABJRU5ErkJggg=="
)


def embed_images(json: Json, document: Document, packing: Packing, resolve: Resolve | None) -> list[str]:
    """Store images that textures use as views, in place, and drop references to others; return notes.

    json: an edited copy of the document's. Unused and unreadable images become a white pixel, so that indices stay.
    """
    images, textures = json_array(json, "images"), json_array(json, "textures")
    wanted = {source for texture in textures if isinstance(texture, dict) for source in _sources(texture)}
    drawn: set[int] = set()
    faults: dict[int, str] = {}
    accessors = Accessors(document)
    for i in sorted(each for each in wanted if 0 <= each < len(images)):
        try:
            data = image_data(document, i, accessors, resolve)
            _store(images[i], data, packing)
            drawn.add(i)
        except AnimError as error:
            faults[i] = f"image {i} ({error})"
    pixel = None
    for i in range(len(images)):
        if i not in drawn:
            pixel = packing.add(np.frombuffer(WHITE_PIXEL, np.uint8)) if pixel is None else pixel
            images[i] = {"bufferView": pixel, "mimeType": "image/png"}
    sources = [set(_sources(texture)) if isinstance(texture, dict) else set() for texture in textures]
    usable = {i for i, texture in enumerate(textures) if _choose_source(texture, drawn)}
    missed = set().union(*(sources[i] for i in range(len(textures)) if i not in usable))
    lost = sum(_drop_textures(material, usable) for material in json_array(json, "materials"))
    return _notes([fault for i, fault in faults.items() if i in missed], lost)


def _store(image: Json, data: Bytes, packing: Packing) -> None:
    """Replace an image's URI by a view, in place. Raises FormatError for a format that browsers do not draw."""
    media = media_type(data[:HEAD_BYTES].tobytes())
    if media not in DRAWN:
        raise FormatError("is KTX2" if media == "image/ktx2" else "is no PNG, JPEG, WebP or AVIF")
    if image.pop("uri", None) is not None:
        image["bufferView"] = packing.add(data)
    image["mimeType"] = media


def _sources(texture: Json) -> Iterator[int]:
    """Images that a texture and its extensions name."""
    extensions = texture.get("extensions")
    named = extensions if isinstance(extensions, dict) else {}
    for part in (texture, *(named.get(name) for name in (*PREFERRED, BASISU))):
        yield from _own_source(part)


def _choose_source(texture: Any, drawn: Collection[int]) -> bool:
    """Drop the sources that are not drawn from a texture, in place; return False if none is left."""
    if not isinstance(texture, dict):
        return False
    extensions = texture.pop("extensions", None)
    named = extensions if isinstance(extensions, dict) else {}
    kept = {name: named[name] for name in PREFERRED if any(each in drawn for each in _own_source(named.get(name)))}
    if kept:
        texture["extensions"] = kept
    if not any(each in drawn for each in _own_source(texture)):
        texture.pop("source", None)
    if kept and "source" not in texture:  # for three.js where a browser knows neither format
        texture["source"] = next(iter(kept.values()))["source"]
    return "source" in texture


def _own_source(part: Any) -> Iterator[int]:
    source = part.get("source") if isinstance(part, dict) else None
    if type(source) is int:
        yield source


def _drop_textures(part: Any, usable: Collection[int]) -> int:
    """Drop references to textures that are not usable, in place, and return their count."""
    if not isinstance(part, dict):
        return 0
    lost = 0
    for key, value in list(part.items()):
        if key.endswith("Texture") and not (isinstance(value, dict) and _is_usable(value.get("index"), usable)):
            del part[key]
            lost += 1
        elif key != "extras":
            lost += _drop_textures(value, usable)
    return lost


def _is_usable(index: Any, usable: Collection[int]) -> bool:
    return type(index) is int and index in usable


def _notes(faults: list[str], lost: int) -> list[str]:
    if not faults:
        return [f"{plural(lost, 'texture')} without an image: drawn without"] if lost else []
    return [f"{plural(len(faults), 'image')} not drawn: {list_some(faults, FEW)}"]
