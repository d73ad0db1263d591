"""Bytes of an image as the file keeps it: in a buffer view, in a data URI, or in a file beside it."""

from __future__ import annotations

import numpy as np

from anim.errors import FormatError
from anim.gltf.document import Bytes, Document, json_array
from anim.gltf.io import uri
from anim.gltf.io.container import Resolve
from anim.gltf.reading.accessors import Accessors


def image_data(document: Document, index: int, accessors: Accessors, resolve: Resolve | None = None) -> Bytes:
    """Return the encoded bytes of an image.

    resolve: gives the bytes of a file beside the input by its relative path; None where there is no such place.
    Raises FormatError where they can't be had.
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
