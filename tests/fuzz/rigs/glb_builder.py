"""A plain writer of GLB files, one accessor per array."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

Json = dict[str, Any]

COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
LARGEST = {"i1": 127, "u1": 255, "i2": 32767, "u2": 65535}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class GlbBuilder:
    """A document with one buffer. lists: its arrays, by name."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self.lists: dict[str, list[Json]] = {
            name: [] for name in ("nodes", "meshes", "skins", "animations", "accessors", "bufferViews")
        }

    def add(self, name: str, value: Json) -> int:
        """Add to an array, and return the index."""
        self.lists[name].append(value)
        return len(self.lists[name]) - 1

    def add_accessor(
        self, values: ArrayLike, kind: str = "f4", *, normalized: bool = False, bounds: bool = False
    ) -> int:
        """Add an array (count, C) of numbers; normalized ones are rounded to integers."""
        given = np.asarray(values)
        given = given[:, None] if given.ndim == 1 else given
        if normalized:
            given = np.round(given * LARGEST[kind])
        stored = given.astype(f"<{kind}")
        self._buffer += b"\0" * (-len(self._buffer) % 4)
        start = len(self._buffer)
        for row in stored:  # each element of a vertex attribute begins at a multiple of four
            self._buffer += row.tobytes() + b"\0" * (-row.nbytes % 4 if stored.shape[1] > 1 else 0)
        size = stored.itemsize * stored.shape[1]
        view: Json = {"buffer": 0, "byteOffset": start, "byteLength": len(self._buffer) - start}
        if stored.shape[1] > 1 and size % 4:
            view["byteStride"] = size + -size % 4
        accessor: Json = {
            "bufferView": self.add("bufferViews", view),
            "componentType": COMPONENTS[kind],
            "count": len(stored),
            "type": TYPES[stored.shape[1]],
        }
        if normalized:
            accessor["normalized"] = True
        if bounds:
            accessor |= {"min": stored.min(axis=0).tolist(), "max": stored.max(axis=0).tolist()}
        return self.add("accessors", accessor)

    def to_bytes(self, **top: Any) -> bytes:
        """Return the GLB. top: other members of the document."""
        blob = bytes(self._buffer) + b"\0" * (-len(self._buffer) % 4)
        lists = {name: values for name, values in self.lists.items() if values}
        document = {"asset": {"version": "2.0"}, "buffers": [{"byteLength": len(blob)}], **lists, **top}
        content = json.dumps(document).encode()
        content += b" " * (-len(content) % 4)
        chunks = struct.pack("<I4s", len(content), b"JSON") + content + struct.pack("<I4s", len(blob), b"BIN\0") + blob
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
