"""Bytes of animation values as they are stored: compressed, shared, overlapping."""

from __future__ import annotations

from anim.gltf.document import Document, Json, json_array
from anim.gltf.validation import buffer_layout
from anim.gltf.writing import byte_ranges
from anim.gltf.writing.references import references_outside, sampled_accessors, views_of_all


def stored_bytes(document: Document) -> int:
    """Return the bytes that only animations use in the buffers; the compressed size of compressed views."""
    content = document.json
    clips = json_array(content, "animations")
    samplers = [sampler for animation in clips for sampler in animation["samplers"]]
    others = references_outside(content, range(len(clips))).accessors
    accessors, views = json_array(content, "accessors"), json_array(content, "bufferViews")
    mine = [accessors[number] for number in sampled_accessors(samplers) - others]
    stored, used = [about for about in mine if "bufferView" in about], views_of_all(mine)
    if len({about["bufferView"] for about in stored}) == len(stored) and not any(
        "extensions" in views[i] for i in used
    ):
        return sum(map(value_bytes, stored))  # as most files are: each accessor has a view of its own
    spans: dict[int, list[byte_ranges.Range]] = {view: [] for view in used}
    for about in stored:
        spans[about["bufferView"]].append(_span(about))
    return sum([_bytes_in(views[view], parts) for view, parts in spans.items()])


def value_bytes(accessor: Json) -> int:
    """Return the bytes of an accessor's values without gaps; 0 of a type that glTF 2.0 does not define."""
    if accessor["type"] not in buffer_layout.COMPONENTS:
        return 0
    return int(accessor["count"]) * buffer_layout.element_size(accessor["componentType"], accessor["type"])


def _bytes_in(view: Json, parts: list[byte_ranges.Range]) -> int:
    """Bytes of these parts of a view; of a compressed one all of its bytes as stored."""
    found = buffer_layout.compression(view) if "extensions" in view else None
    if found is not None:
        return int(found["byteLength"])
    return sum([end - start for start, end in (byte_ranges.union(parts) if len(parts) > 1 else parts)])


def _span(accessor: Json) -> byte_ranges.Range:
    start = accessor.get("byteOffset", 0)
    return start, start + value_bytes(accessor)
