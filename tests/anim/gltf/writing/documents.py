"""What tests of writing share: clips replaced by themselves, and tracks and views compared bit by bit."""

from __future__ import annotations

import numpy as np

from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.model import Track


def rewritten(document: Document) -> Document:
    """Return the document with every clip replaced by itself."""
    return writer.replace_clips(document, dict(enumerate(reader.clips(document))))


def check_same(a: Track, b: Track) -> None:
    """Two tracks that say the same, bit by bit."""
    assert (a.node, a.path, a.pointer, a.interpolation) == (b.node, b.path, b.pointer, b.interpolation)
    assert (a.storage.component_type, a.storage.normalized) == (b.storage.component_type, b.storage.normalized)
    for name in ("times", "values", "in_tangents", "out_tangents"):
        x, y = getattr(a, name), getattr(b, name)
        assert (x is None) == (y is None)
        if x is not None:
            np.testing.assert_array_equal(x, y)


def viewed(document: Document, view: int) -> bytes:
    """Return the bytes of a view."""
    place = document.json["bufferViews"][view]
    start = place.get("byteOffset", 0)
    data = document.buffers[place["buffer"]].data
    return bytes(data[start : start + place["byteLength"]].tobytes())
