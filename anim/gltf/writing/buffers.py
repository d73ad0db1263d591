"""Rebuild the buffers while clips are replaced: drop unused bytes, add those of new views."""

from __future__ import annotations

from collections.abc import Sequence, Set
from typing import NamedTuple

import numpy as np

from anim.gltf.document import Buffer, Bytes, Document, Json, json_array
from anim.gltf.meshopt import fallback_buffer
from anim.gltf.writing import byte_ranges, compaction
from anim.gltf.writing.buffer_views import View
from anim.gltf.writing.byte_ranges import OffsetMap
from anim.gltf.writing.references import References

MIN_FREED_BYTES = 4  # bytes of an otherwise empty buffer: glTF requires at least one


class RebuiltBuffers(NamedTuple):
    """Buffers after the change.

    described: their JSON. views: JSON of the new views. shift: new byte offsets of each old buffer.
    target: the buffer of the new bytes.
    """

    buffers: tuple[Buffer, ...]
    described: list[Json]
    views: list[Json]
    shift: list[OffsetMap]
    target: int


def rebuild_buffers(
    document: Document, freed: Set[int], unused: Set[int], outside: References, new: Sequence[View], extension: str
) -> RebuiltBuffers:
    """Return the buffers without the bytes of `freed` accessors and `unused` views, plus `new` views.

    extension: of the compressed ones among `new`.
    """
    json = document.json
    frozen = outside.frozen_buffers
    imagined = fallback_buffer.drop_data(json, document.buffers, frozen)
    movable = {i for i, buffer in enumerate(document.buffers) if buffer.has_data} - frozen | imagined
    shift = compaction.offset_maps(document, freed, unused, outside, movable)
    target = _choose_target(document, shift)
    pieces = [_bytes(view.stored) for view in new]
    shift = [
        moved if pieces and i == target else _leave_bytes(moved, document.buffers[i].byte_length)
        for i, moved in enumerate(shift)
    ]
    buffers = _rebuild(document, shift, target, pieces)
    described = [*json_array(json, "buffers"), *({} for _ in buffers[len(document.buffers) :])]
    left = [view for i, view in enumerate(json_array(json, "bufferViews")) if i not in unused]
    decoded = _reserve_fallback(buffers, described, left, imagined, new, extension)
    spare = _emptied_buffers(document, unused, left) - frozen - {target} - ({decoded[0]} if decoded else set())
    while len(buffers) - 1 in spare and fallback_buffer.is_marked(described[-1]):
        del buffers[-1], described[-1]
    at = (target, buffers[target].byte_length - sum(map(len, pieces)) if new else 0)
    views = _view_json(new, at, decoded or (0, 0), extension)
    return RebuiltBuffers(tuple(buffers), list(map(_buffer_json, described, buffers)), views, shift, target)


def _choose_target(document: Document, shift: Sequence[OffsetMap]) -> int:
    """Index of the buffer for new data: the one with most dropped bytes, else the first, else a new one.

    Never a fallback buffer: it must contain decompressed views only.
    """
    described = json_array(document.json, "buffers")
    candidates = [
        i
        for i, buffer in enumerate(document.buffers)
        if buffer.has_data and not fallback_buffer.is_marked(described[i])
    ]
    return max(candidates, key=lambda i: (shift[i].dropped_bytes, -i), default=len(document.buffers))


def _leave_bytes(shift: OffsetMap, length: int) -> OffsetMap:
    """The same map, but an otherwise empty buffer keeps its first bytes."""
    return shift if shift(length) else OffsetMap(byte_ranges.difference(shift.dropped, [(0, MIN_FREED_BYTES)]))


def _rebuild(document: Document, shift: Sequence[OffsetMap], target: int, data: list[Bytes]) -> list[Buffer]:
    buffers = [
        compaction.rebuild_buffer(buffer, moved, data if i == target else [], f"buffer {i}")
        for i, (buffer, moved) in enumerate(zip(document.buffers, shift, strict=True))
    ]
    if data and target == len(buffers):
        buffers.append(
            compaction.rebuild_buffer(Buffer(0, None, lambda: _bytes(b"")), OffsetMap([]), data, f"buffer {target}")
        )
    return buffers


def _reserve_fallback(
    buffers: list[Buffer],
    described: list[Json],
    left: Sequence[Json],
    imagined: Set[int],
    new: Sequence[View],
    extension: str,
) -> tuple[int, int] | None:
    """Reserve a fallback buffer for new compressed views, in place; return (its index, offset).

    None if no view is compressed. left: the remaining old views. imagined: the existing buffers without bytes.
    """
    room = sum(_whole_views(view.length) for view in new if view.stride)
    if not room:
        return None
    place = fallback_buffer.find_fallback(described, left, imagined, extension)
    if place is None:
        place = len(buffers)
        buffers.append(Buffer(0, None, None))
        described.append({})
    is_empty = all(view["buffer"] != place for view in left)
    start = 0 if is_empty else _whole_views(buffers[place].byte_length)
    buffers[place] = Buffer(start + room, None, None)
    if is_empty and not fallback_buffer.is_marked(described[place], extension):
        described[place] = fallback_buffer.fallback_json(room, extension)
    return place, start


def _emptied_buffers(document: Document, unused: Set[int], left: Sequence[Json]) -> set[int]:
    """Buffers of unused views without any remaining view."""
    views = json_array(document.json, "bufferViews")
    lost = {buffer for i in unused for buffer, _ in compaction.referenced_ranges(views[i])}
    return lost - {buffer for view in left for buffer, _ in compaction.referenced_ranges(view)}


def _view_json(new: Sequence[View], at: tuple[int, int], decoded: tuple[int, int], extension: str) -> list[Json]:
    views = []
    for view in new:
        views.append(view.about(at, decoded, extension))
        at = at[0], at[1] + _whole_views(len(view.stored))
        decoded = decoded[0], decoded[1] + (_whole_views(view.length) if view.stride else 0)
    return views


def _buffer_json(about: Json, buffer: Buffer) -> Json:
    same = about.get("byteLength") == buffer.byte_length
    return about if same else {**about, "byteLength": buffer.byte_length}


def _bytes(data: bytes) -> Bytes:
    return np.frombuffer(data + bytes(-len(data) % byte_ranges.ALIGNMENT_BYTES), np.uint8)


def _whole_views(length: int) -> int:
    return length + -length % byte_ranges.ALIGNMENT_BYTES
