"""All buffers of a document in the BIN chunk of one GLB."""

from __future__ import annotations

import numpy as np

from anim.arrays import Bytes
from anim.gltf.document import Buffer, Document, Json, json_array
from anim.gltf.validation.buffer_layout import compression

ALIGNMENT_BYTES = 8  # multiple of each component's size, and of a meshopt stream's start


class Packing:
    """Bytes of one buffer: first those of a document's buffers, then new views.

    Fallback buffers without data keep their views, with new indices behind the packed one.
    """

    def __init__(self, document: Document) -> None:
        self._pieces: list[Bytes] = []
        self._size = 0
        self._offsets: dict[int, int] = {}
        self._fallbacks: list[int] = []
        self._views: list[tuple[int, int]] = []
        self._old = document
        self._first_view = len(json_array(document.json, "bufferViews"))
        for i, buffer in enumerate(document.buffers):
            if buffer.has_data:
                self._offsets[i] = self._append(buffer.data)
            else:
                self._fallbacks.append(i)

    def add(self, data: Bytes) -> int:
        """Return the index of a new buffer view of these bytes."""
        self._views.append((self._append(data), len(data)))
        return self._first_view + len(self._views) - 1

    def document(self, json: Json) -> Document:
        """Return a document of this JSON, an edited copy of the old one's, with the packed buffer first."""
        if not self._size:
            return Document({key: value for key, value in json.items() if key != "buffers"}, ())
        described = json_array(json, "buffers")
        views = [self._moved(view) for view in json_array(json, "bufferViews")]
        views += [{"buffer": 0, "byteOffset": offset, "byteLength": length} for offset, length in self._views]
        packed = {**json, "buffers": [{"byteLength": self._size}, *(described[i] for i in self._fallbacks)]}
        if views:
            packed["bufferViews"] = views
        whole = Buffer(self._size, None, lambda: np.concatenate(self._pieces))
        return Document(packed, (whole, *(self._old.buffers[i] for i in self._fallbacks)))

    def _append(self, data: Bytes) -> int:
        offset, padding = self._size, np.zeros(-len(data) % ALIGNMENT_BYTES, np.uint8)
        self._pieces += [data, padding]
        self._size += len(data) + len(padding)
        return offset

    def _moved(self, view: Json) -> Json:
        moved, compressed = self._place(view), compression(view)
        if compressed is None:
            return moved
        there = self._place(compressed)
        extensions = {name: there if each is compressed else each for name, each in view["extensions"].items()}
        return {**moved, "extensions": extensions}

    def _place(self, about: Json) -> Json:
        """JSON of a view, or of its compressed stream, at its position in the packed buffer."""
        buffer = about["buffer"]
        if buffer not in self._offsets:
            return {**about, "buffer": 1 + self._fallbacks.index(buffer)}
        return {**about, "buffer": 0, "byteOffset": self._offsets[buffer] + about.get("byteOffset", 0)}
