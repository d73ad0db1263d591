"""Drop unused bytes of buffers and relocate the views and accessors after them."""

from __future__ import annotations

from collections.abc import Iterator, Set

import numpy as np

from anim.gltf.document import Buffer, Bytes, Document, Json, json_array
from anim.gltf.validation import buffer_layout
from anim.gltf.writing import byte_ranges
from anim.gltf.writing.byte_ranges import OffsetMap, Range
from anim.gltf.writing.references import References, views_of


def unused_views(document: Document, freed: Set[int], outside: References) -> set[int]:
    """Return the views that only accessors in `freed` use."""
    accessors = json_array(document.json, "accessors")
    theirs = {view for number in freed for view in views_of(accessors[number])}
    others = {view for i, accessor in enumerate(accessors) if i not in freed for view in views_of(accessor)}
    return theirs - others - outside.views


def offset_maps(
    document: Document, freed: Set[int], unused: Set[int], outside: References, movable: Set[int]
) -> list[OffsetMap]:
    """Return the offset map of each buffer without its freed accessors and unused views.

    A view shared by freed accessors and others loses their bytes too, unless something refers to the view itself.
    movable: buffers with movable bytes; others are unchanged.
    """
    dropped: list[list[Range]] = [[] for _ in document.buffers]
    needed: list[list[Range]] = [[] for _ in document.buffers]
    spans = _spans(document.json, freed)
    for number, view in enumerate(json_array(document.json, "bufferViews")):
        for buffer, place in referenced_ranges(view):
            if number in unused:
                dropped[buffer] += [] if is_placeholder(view) else [place]
                continue
            shared = [] if number in outside.views or buffer_layout.compression(view) else spans.get(number, [])
            theirs = [_relocate(span, place[0]) for i, span in shared if i in freed]
            kept = [_relocate(span, place[0]) for i, span in shared if i not in freed]
            free = byte_ranges.difference(theirs, kept)
            dropped[buffer] += free
            needed[buffer] += byte_ranges.difference([place], free)
    return [
        OffsetMap(_droppable(d, n, b.byte_length) if i in movable else [])
        for i, (d, n, b) in enumerate(zip(dropped, needed, document.buffers, strict=True))
    ]


def is_placeholder(view: Json) -> bool:
    """Return True for a possible placeholder view: one byte that is not its own."""
    return view.keys() == {"buffer", "byteLength"} and view["byteLength"] == 1


def relocate_view(view: Json, shift: list[OffsetMap]) -> Json:
    """Return a view with the new offsets of its bytes and of its compressed data."""
    moved = _relocate_offsets(view, shift[view["buffer"]])
    compressed = buffer_layout.compression(view)
    if compressed is not None:
        here = _relocate_offsets(compressed, shift[compressed["buffer"]])
        extensions = {n: here if e is compressed else e for n, e in view["extensions"].items()}
        moved = {**moved, "extensions": extensions}
    return moved


def relocate_accessor(accessor: Json, views: list[Json], shift: list[OffsetMap]) -> Json:
    """Return an accessor with the new offsets into its views. views: the old ones."""
    moved = _relocate_offset(accessor, views, shift)
    if "sparse" in accessor:
        parts = {part: _relocate_offset(accessor["sparse"][part], views, shift) for part in ("indices", "values")}
        if any(parts[part] is not accessor["sparse"][part] for part in parts):
            moved = {**moved, "sparse": {**accessor["sparse"], **parts}}
    return moved


def rebuild_buffer(buffer: Buffer, shift: OffsetMap, appended: list[Bytes], where: str) -> Buffer:
    """Return the buffer without dropped bytes and with `appended` ones, aligned to four.

    A buffer without data only gets shorter. What one before had dropped is dropped with it, from the bytes that both
    come from: buffers in between are not loaded.
    """
    if not shift.dropped and not appended:
        return buffer
    length = shift(buffer.byte_length)
    if not buffer.has_data:
        return Buffer(length, buffer.uri, None, where=where)
    padding = np.zeros(-length % 4 if appended else 0, np.uint8)
    origin, before = buffer.shortened or (buffer, [])
    dropped = byte_ranges.all_dropped(before, shift.dropped)

    def load() -> Bytes:
        kept = byte_ranges.difference([(0, origin.byte_length)], dropped)
        return np.concatenate([*(origin.data[start:end] for start, end in kept), padding, *appended])

    total = length + len(padding) + sum(len(piece) for piece in appended)
    shortened = None if appended else (origin, dropped)
    return Buffer(total, buffer.uri, load, where=where, replaced=True, shortened=shortened)


def referenced_ranges(view: Json) -> Iterator[tuple[int, Range]]:
    """Yield (buffer, range) of a view's decoded bytes, and of its compressed ones."""
    yield view["buffer"], _span(view, view["byteLength"])
    compressed = buffer_layout.compression(view)
    if compressed is not None:
        yield compressed["buffer"], _span(compressed, compressed["byteLength"])


def _spans(json: Json, freed: Set[int]) -> dict[int, list[tuple[int, Range]]]:
    """For each view of a freed accessor: (accessor, range) of all its accessors, from the view's start."""
    accessors, views = json_array(json, "accessors"), json_array(json, "bufferViews")
    wanted = {view for number in freed for view in views_of(accessors[number])}
    spans: dict[int, list[tuple[int, Range]]] = {view: [] for view in wanted}
    for i, accessor in enumerate(accessors):
        for view, span in _accessor_spans(accessor, views):
            if view in wanted:
                spans[view].append((i, span))
    return spans


def _accessor_spans(accessor: Json, views: list[Json]) -> Iterator[tuple[int, Range]]:
    if accessor["type"] not in buffer_layout.COMPONENTS:  # unknown type: its size is unknown too
        yield from ((view, (0, views[view]["byteLength"])) for view in views_of(accessor))
        return
    size = buffer_layout.element_size(accessor["componentType"], accessor["type"])
    if "bufferView" in accessor:
        view = views[accessor["bufferView"]]
        yield accessor["bufferView"], _rows_span(accessor, size, view.get("byteStride", size), view["byteLength"])
    if "sparse" in accessor:
        sparse = accessor["sparse"]
        index_size = buffer_layout.COMPONENT_SIZES[sparse["indices"]["componentType"]]
        yield sparse["indices"]["bufferView"], _span(sparse["indices"], index_size * sparse["count"])
        yield sparse["values"]["bufferView"], _span(sparse["values"], size * sparse["count"])


def _rows_span(accessor: Json, size: int, stride: int, view_bytes: int) -> Range:
    """Span of an accessor's elements; of interleaved ones, whole rows, all of which three.js reads."""
    start, end = _span(accessor, stride * (accessor["count"] - 1) + size)
    if stride == size:
        return start, end
    first = start // stride * stride
    return first, max(end, min(first + stride * accessor["count"], view_bytes))


def _span(place: Json, length: int) -> Range:
    start = place.get("byteOffset", 0)
    return start, start + length


def _relocate(span: Range, by: int) -> Range:
    return span[0] + by, span[1] + by


def _droppable(dropped: list[Range], needed: list[Range], length: int) -> list[Range]:
    """Droppable ranges: no needed byte, whole multiples of four.

    Padding between dropped ranges is included.
    """
    free = byte_ranges.difference(dropped, needed)
    if not free:
        return []
    unnamed = byte_ranges.difference([(0, length)], [*free, *needed])
    edges = {edge for span in free for edge in span}
    padding = [(s, e) for s, e in unnamed if e - s < byte_ranges.ALIGNMENT_BYTES and (s in edges or e in edges)]
    return byte_ranges.aligned(byte_ranges.union([*free, *padding]))


def _relocate_offsets(place: Json, shift: OffsetMap) -> Json:
    start, end = _span(place, place["byteLength"])
    new_start, new_end = shift(start), shift(end)
    if (new_start, new_end) == (start, end):
        return place
    moved = {**place, "byteLength": new_end - new_start}
    if new_start or "byteOffset" in place:
        moved["byteOffset"] = new_start
    return moved


def _relocate_offset(place: Json, views: list[Json], shift: list[OffsetMap]) -> Json:
    if "bufferView" not in place:
        return place
    view = views[place["bufferView"]]
    if buffer_layout.compression(view) is not None:
        return place
    to = shift[view["buffer"]]
    base, offset = view.get("byteOffset", 0), place.get("byteOffset", 0)
    new = to(base + offset) - to(base)
    return place if new == offset else {**place, "byteOffset": new}
