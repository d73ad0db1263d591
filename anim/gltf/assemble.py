"""New accessors into a document: freed numbers used again, dead bytes dropped, all numbers in one view."""

from __future__ import annotations

from collections.abc import Sequence, Set

import numpy as np

from anim.gltf import compact, ranges, references
from anim.gltf.document import Buffer, Bytes, Document, Json, items
from anim.gltf.encode import Numbers
from anim.gltf.ranges import Shift
from anim.gltf.slots import Slots

# What stands where a number is left over; on the next write it is free again.
EMPTY_ACCESSOR: Json = {"componentType": 5121, "count": 1, "type": "SCALAR"}
EMPTY_VIEW_KEYS = {"buffer", "byteLength"}
LEAST = 4  # bytes of a buffer that nothing is left of: glTF knows none without


class Place(int):
    """A place among the new contents, where the number of an accessor will stand."""


def assemble(
    document: Document, animations: Sequence[Json], replaced: Set[int], contents: Sequence[Numbers]
) -> Document:
    """Return the document with these animations, whose samplers name `contents` by Place, else accessors as before.

    replaced: numbers of the animations of `document` that are no longer there as they were.
    """
    outside = references.outside(document.json, replaced)
    old_views = items(document.json, "bufferViews")
    freed = _accessors_of(document.json, replaced) | _placeholders(document.json)
    freed = freed - outside.accessors - _still_named(animations)
    unused = compact.unused_views(document, freed, outside) | _empty_views(document.json, outside)
    shift = compact.shifts(document, freed, unused, outside, references.frozen_buffers(document.json))
    data, offsets = _joined(contents)
    target = _target_buffer(document, shift)
    shift = [
        moved if data and i == target else _leaving_some(moved, document.buffers[i].byte_length)
        for i, moved in enumerate(shift)
    ]
    buffers = _rebuilt(document, shift, target, data)

    view_slots = Slots(len(old_views), unused, 1 if data else 0)
    views = [compact.moved_view(view, shift) for view in old_views]
    view_slots.fill(views, _new_view(buffers, target, data), {"buffer": target, "byteLength": 1})
    accessor_slots = Slots(len(items(document.json, "accessors")), freed, len(contents))
    accessors = [compact.moved_accessor(about, old_views, shift) for about in items(document.json, "accessors")]
    new = [each.accessor(view_slots.numbers[0], offset) for each, offset in zip(contents, offsets, strict=True)]
    accessor_slots.fill(accessors, new, EMPTY_ACCESSOR)

    json = dict(document.json)
    _set_list(json, "animations", [_numbered(animation, accessor_slots.numbers) for animation in animations])
    _set_list(json, "accessors", accessors)
    _set_list(json, "bufferViews", views)
    _set_list(json, "buffers", _described(items(document.json, "buffers"), buffers))
    return Document(json, tuple(buffers), document.chunks, document.indent)


def _accessors_of(json: Json, animations: Set[int]) -> set[int]:
    found = items(json, "animations")
    return {sampler[key] for i in animations for sampler in found[i]["samplers"] for key in ("input", "output")}


def _placeholders(json: Json) -> set[int]:
    return {i for i, accessor in enumerate(items(json, "accessors")) if accessor == EMPTY_ACCESSOR}


def _empty_views(json: Json, outside: references.References) -> set[int]:
    named = {view for accessor in items(json, "accessors") for view in references.views_of(accessor)} | outside.views
    views = enumerate(items(json, "bufferViews"))
    return {i for i, view in views if view.keys() == EMPTY_VIEW_KEYS and view["byteLength"] == 1 and i not in named}


def _leaving_some(shift: Shift, length: int) -> Shift:
    """The same, but that a buffer which would end up empty keeps its first bytes."""
    return shift if shift(length) else Shift(ranges.difference(shift.dropped, [(0, LEAST)]))


def _still_named(animations: Sequence[Json]) -> set[int]:
    numbers = (sampler[key] for a in animations for sampler in a["samplers"] for key in ("input", "output"))
    return {number for number in numbers if not isinstance(number, Place)}


def _target_buffer(document: Document, shift: Sequence[Shift]) -> int:
    """The buffer that new data goes to: where most was dropped, else the first with data, else one more."""
    candidates = [i for i, buffer in enumerate(document.buffers) if buffer.has_data]
    return max(candidates, key=lambda i: (shift[i].dropped_bytes, -i), default=len(document.buffers))


def _rebuilt(document: Document, shift: Sequence[Shift], target: int, data: list[Bytes]) -> list[Buffer]:
    buffers = [
        compact.rebuilt(buffer, moved, data if i == target else [], f"buffer {i}")
        for i, (buffer, moved) in enumerate(zip(document.buffers, shift, strict=True))
    ]
    if data and target == len(buffers):
        buffers.append(compact.rebuilt(Buffer(0, None, None), Shift([]), data, f"buffer {target}"))
    return buffers


def _joined(contents: Sequence[Numbers]) -> tuple[list[Bytes], list[int]]:
    """The bytes of all contents, each on a multiple of four, and where each starts."""
    pieces: list[Bytes] = []
    offsets = []
    at = 0
    for each in contents:
        offsets.append(at)
        padded = each.data + bytes(-len(each.data) % 4)
        pieces.append(np.frombuffer(padded, np.uint8))
        at += len(padded)
    return pieces, offsets


def _new_view(buffers: list[Buffer], target: int, data: list[Bytes]) -> list[Json]:
    if not data:
        return []
    length = sum(len(piece) for piece in data)
    start = buffers[target].byte_length - length
    return [{"buffer": target, **({"byteOffset": start} if start else {}), "byteLength": length}]


def _numbered(animation: Json, numbers: list[int]) -> Json:
    samplers = [
        {key: numbers[value] if isinstance(value, Place) else value for key, value in sampler.items()}
        for sampler in animation["samplers"]
    ]
    return {**animation, "samplers": samplers}


def _described(old: list[Json], buffers: list[Buffer]) -> list[Json]:
    described = []
    for i, buffer in enumerate(buffers):
        about = old[i] if i < len(old) else {}
        same = about.get("byteLength") == buffer.byte_length
        described.append(about if same else {**about, "byteLength": buffer.byte_length})
    return described


def _set_list(json: Json, key: str, objects: list[Json]) -> None:
    if objects:
        json[key] = objects
    elif json.get(key):
        del json[key]
