"""Edit the JSON of a document: add accessors, and drop those that the new JSON does not use."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from anim.arrays import AnyArray
from anim.gltf.document import Document, Json, json_array
from anim.gltf.writing import compaction, reindex
from anim.gltf.writing.append import COMPONENT_TYPES, ELEMENTS, VERTICES
from anim.gltf.writing.buffer_views import View
from anim.gltf.writing.buffers import rebuild_buffers
from anim.gltf.writing.insertion import EMPTY_ACCESSOR
from anim.gltf.writing.references import named_accessors, references_outside

ViewKey = tuple[int | None, int]  # target, and bytes per element


@dataclass(slots=True)
class NewAccessors:
    """New accessors of a document, with indices after its own ones.

    first: index of the first. Contents with the same target and size of elements share a buffer view.
    """

    first: int
    described: list[Json] = field(default_factory=list)
    _keys: list[ViewKey | None] = field(default_factory=list)
    _pieces: dict[ViewKey, list[bytes]] = field(default_factory=dict)
    _sizes: dict[ViewKey, int] = field(default_factory=dict)

    def add(self, rows: AnyArray, *, target: int | None = None, normalized: bool = False, bounds: bool = False) -> int:
        """Return the index of an accessor of rows (n, C), already of their stored type.

        Rows of vertices are padded to a multiple of 4 bytes.
        """
        about: Json = {"componentType": COMPONENT_TYPES[rows.dtype.str]}
        if normalized:
            about["normalized"] = True
        about |= {"count": len(rows), "type": ELEMENTS[rows.shape[1]]}
        if bounds:
            about["min"] = [float(value) for value in rows.min(axis=0)]
            about["max"] = [float(value) for value in rows.max(axis=0)]
        data, size = _padded(rows, target)
        key = (target, size)
        offset = self._sizes.get(key, 0)
        if offset:
            about["byteOffset"] = offset
        self._pieces.setdefault(key, []).append(data)
        self._sizes[key] = offset + len(data)
        return self._append(about, key)

    def add_zeros(self, count: int) -> int:
        """Return the index of an accessor of `count` zero vectors, without data."""
        zero = [0.0, 0.0, 0.0]
        about = {"componentType": COMPONENT_TYPES["<f4"], "count": count, "type": "VEC3", "min": zero, "max": zero}
        return self._append(about, None)

    def _append(self, about: Json, key: ViewKey | None) -> int:
        self.described.append(about)
        self._keys.append(key)
        return self.first + len(self.described) - 1

    def views(self) -> list[View]:
        """Return the contents of the new buffer views."""
        return [View(b"".join(pieces), self._sizes[key]) for key, pieces in self._pieces.items()]

    def view_json(self, view: int) -> Json:
        """Return the target and the stride of a new view."""
        target, size = list(self._pieces)[view]
        return (
            {}
            if target is None
            else {"byteStride": size, "target": target}
            if target == VERTICES
            else {"target": target}
        )

    def accessor_json(self, first_view: int) -> list[Json]:
        """Return the JSON of the accessors, whose views begin at an index."""
        index = {key: first_view + i for i, key in enumerate(self._pieces)}
        return [
            about if key is None else {"bufferView": index[key], **about}
            for about, key in zip(self.described, self._keys, strict=True)
        ]


def edit_document(document: Document, json: Json, new: NewAccessors) -> Document:
    """Return a document of this JSON, which may refer to `new` accessors.

    json: an edited copy of the document's; its accessors, views and buffers are ignored. Accessors that it no longer
    uses are dropped with their bytes; all others keep their bytes.
    """
    accessors, old_views = json_array(document.json, "accessors"), json_array(document.json, "bufferViews")
    used = references_outside(json, ())
    freed = {i for i in named_accessors(document.json) if i < len(accessors)} - used.accessors
    unused = compaction.unused_views(document, freed, used)
    store = rebuild_buffers(document, freed, unused, used, new.views(), "")
    placeholder = {"buffer": store.target, "byteLength": 1}
    views = [
        placeholder if i in unused else compaction.relocate_view(view, store.shift) for i, view in enumerate(old_views)
    ]
    views += [{**view, **new.view_json(i)} for i, view in enumerate(store.views)]
    moved = [
        EMPTY_ACCESSOR if i in freed else compaction.relocate_accessor(about, old_views, store.shift)
        for i, about in enumerate(accessors)
    ]
    edited = dict(json)
    edited["accessors"] = [*moved, *new.accessor_json(len(old_views))]
    edited["bufferViews"], edited["buffers"] = views, store.described
    for key in ("accessors", "bufferViews", "buffers"):
        if not edited[key]:
            del edited[key]
    return reindex.drop_placeholders(Document(edited, store.buffers, document.chunks, document.indent))


def _padded(rows: AnyArray, target: int | None) -> tuple[bytes, int]:
    """Bytes of rows, and bytes per row; the end is padded to 4 bytes, and so is each row of vertices."""
    size = rows.shape[1] * rows.dtype.itemsize
    if target == VERTICES and size % 4:
        size += -size % 4
        wide = np.zeros((len(rows), size // rows.dtype.itemsize), rows.dtype)
        wide[:, : rows.shape[1]] = rows
        rows = wide
    data = np.ascontiguousarray(rows).tobytes()
    return data + bytes(-len(data) % 4), size
