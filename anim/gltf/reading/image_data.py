"""Encoded bytes of an image from a buffer view, a data URI or an external file."""

from __future__ import annotations

import numpy as np

from anim.errors import FormatError
from anim.gltf.document import Bytes, Document, json_array
from anim.gltf.io import uri
from anim.gltf.io.container import Resolve
from anim.gltf.reading.accessors import Accessors


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
