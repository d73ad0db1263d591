"""Bytes of animation values as they are stored: compressed, shared, overlapping."""

from __future__ import annotations

from anim.gltf.document import Document, Json, json_array
from anim.gltf.validation import buffer_layout
from anim.gltf.writing import byte_ranges
from anim.gltf.writing.references import references_outside, views_of


def stored_bytes(document: Document) -> int:
    """Return the bytes that only animations use in the buffers; the compressed size of compressed views."""
    content = document.json
    clips = json_array(content, "animations")
    samplers = [sampler for animation in clips for sampler in animation["samplers"]]
    others = references_outside(content, range(len(clips))).accessors
    mine = {sampler[key] for sampler in samplers for key in ("input", "output")} - others
    accessors, views = json_array(content, "accessors"), json_array(content, "bufferViews")
    spans: dict[int, list[byte_ranges.Range]] = {}
    compressed: dict[int, int] = {}
    for number in mine:
        for view in views_of(accessors[number]):
            found = buffer_layout.compression(views[view])
            if found is not None:
                compressed[view] = found["byteLength"]
            elif accessors[number].get("bufferView") == view:
                spans.setdefault(view, []).append(_span(accessors[number]))
    plain = sum(end - start for parts in spans.values() for start, end in byte_ranges.union(parts))
    return plain + sum(compressed.values())


def _span(accessor: Json) -> byte_ranges.Range:
    start = accessor.get("byteOffset", 0)
    if accessor["type"] not in buffer_layout.COMPONENTS:
        return start, start
    size = buffer_layout.element_size(accessor["componentType"], accessor["type"])
    return start, start + accessor["count"] * size
