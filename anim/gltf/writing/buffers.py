"""The buffers of a document while clips are replaced: dead bytes go, and the bytes of new views come."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass

import numpy as np

from anim.gltf.document import Buffer, Bytes, Document, Json, items
from anim.gltf.meshopt import fallback_buffer
from anim.gltf.writing import byte_ranges, compaction, references
from anim.gltf.writing.buffer_views import View
from anim.gltf.writing.byte_ranges import Shift
from anim.gltf.writing.references import References

LEAST = 4  # bytes of a buffer that nothing is left of: glTF knows none without


@dataclass(frozen=True, slots=True)
class Stored:
    """Buffers after the change.

    described: their JSON. views: JSON of the new views. shift: for each old buffer, where its bytes are now.
    target: the buffer that new bytes go to.
    """

    buffers: tuple[Buffer, ...]
    described: list[Json]
    views: list[Json]
    shift: list[Shift]
    target: int


def stored(
    document: Document, freed: Set[int], unused: Set[int], outside: References, new: Sequence[View], extension: str
) -> Stored:
    """Return the buffers without what only `freed` accessors and `unused` views used, and with the `new` views.

    extension: of the compressed ones among `new`.
    """
    json = document.json
    frozen = references.frozen_buffers(json)
    imagined = fallback_buffer.without_data(json, document.buffers, frozen)
    movable = {i for i, buffer in enumerate(document.buffers) if buffer.has_data} - frozen | imagined
    shift = compaction.shifts(document, freed, unused, outside, movable)
    target = _target(document, shift)
    pieces = [_bytes(view.stored) for view in new]
    shift = [
        moved if pieces and i == target else _leaving_some(moved, document.buffers[i].byte_length)
        for i, moved in enumerate(shift)
    ]
    buffers = _rebuilt(document, shift, target, pieces)
    described = [*items(json, "buffers"), *({} for _ in buffers[len(document.buffers) :])]
    left = [view for i, view in enumerate(items(json, "bufferViews")) if i not in unused]
    decoded = _make_room(buffers, described, left, imagined, new, extension)
    spare = _spare(document, unused, left) - frozen - {target} - ({decoded[0]} if decoded else set())
    while len(buffers) - 1 in spare and fallback_buffer.is_marked(described[-1]):
        del buffers[-1], described[-1]
    at = (target, buffers[target].byte_length - sum(map(len, pieces)) if new else 0)
    views = _described_views(new, at, decoded or (0, 0), extension)
    return Stored(tuple(buffers), list(map(_described, described, buffers)), views, shift, target)


def _target(document: Document, shift: Sequence[Shift]) -> int:
    """The buffer that new data goes to: where most was dropped, else the first with data, else one more.

    Never one that holds what compressed views become: nothing else may lie there.
    """
    described = items(document.json, "buffers")
    candidates = [
        i
        for i, buffer in enumerate(document.buffers)
        if buffer.has_data and not fallback_buffer.is_marked(described[i])
    ]
    return max(candidates, key=lambda i: (shift[i].dropped_bytes, -i), default=len(document.buffers))


def _leaving_some(shift: Shift, length: int) -> Shift:
    """The same, but that a buffer which would end up empty keeps its first bytes."""
    return shift if shift(length) else Shift(byte_ranges.difference(shift.dropped, [(0, LEAST)]))


def _rebuilt(document: Document, shift: Sequence[Shift], target: int, data: list[Bytes]) -> list[Buffer]:
    buffers = [
        compaction.rebuilt(buffer, moved, data if i == target else [], f"buffer {i}")
        for i, (buffer, moved) in enumerate(zip(document.buffers, shift, strict=True))
    ]
    if data and target == len(buffers):
        buffers.append(compaction.rebuilt(Buffer(0, None, lambda: _bytes(b"")), Shift([]), data, f"buffer {target}"))
    return buffers


def _make_room(
    buffers: list[Buffer],
    described: list[Json],
    left: Sequence[Json],
    imagined: Set[int],
    new: Sequence[View],
    extension: str,
) -> tuple[int, int] | None:
    """Let a buffer without bytes stand for those of new compressed views, in place; return (its number, offset).

    None where no view is compressed. left: the old views that stay. imagined: the buffers without bytes there are.
    """
    room = sum(_whole(view.length) for view in new if view.stride)
    if not room:
        return None
    place = fallback_buffer.choice(described, left, imagined, extension)
    if place is None:
        place = len(buffers)
        buffers.append(Buffer(0, None, None))
        described.append({})
    is_empty = all(view["buffer"] != place for view in left)
    start = 0 if is_empty else _whole(buffers[place].byte_length)
    buffers[place] = Buffer(start + room, None, None)
    if is_empty and not fallback_buffer.is_marked(described[place], extension):
        described[place] = fallback_buffer.about(room, extension)
    return place, start


def _spare(document: Document, unused: Set[int], left: Sequence[Json]) -> set[int]:
    """Buffers that an unused view lay in, and that no view is left in."""
    views = items(document.json, "bufferViews")
    lost = {buffer for i in unused for buffer, _ in compaction.places(views[i])}
    return lost - {buffer for view in left for buffer, _ in compaction.places(view)}


def _described_views(new: Sequence[View], at: tuple[int, int], decoded: tuple[int, int], extension: str) -> list[Json]:
    views = []
    for view in new:
        views.append(view.about(at, decoded, extension))
        at = at[0], at[1] + _whole(len(view.stored))
        decoded = decoded[0], decoded[1] + (_whole(view.length) if view.stride else 0)
    return views


def _described(about: Json, buffer: Buffer) -> Json:
    same = about.get("byteLength") == buffer.byte_length
    return about if same else {**about, "byteLength": buffer.byte_length}


def _bytes(data: bytes) -> Bytes:
    return np.frombuffer(data + bytes(-len(data) % byte_ranges.ALIGNMENT), np.uint8)


def _whole(length: int) -> int:
    return length + -length % byte_ranges.ALIGNMENT
