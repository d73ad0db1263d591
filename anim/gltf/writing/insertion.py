"""Insert new accessors into a document: reuse freed indices, append new views to the buffers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence, Set
from types import MappingProxyType

from anim.gltf.document import Document, Json, json_array
from anim.gltf.meshopt import fallback_buffer
from anim.gltf.writing import buffer_views, compaction, references
from anim.gltf.writing.buffers import rebuild_buffers
from anim.gltf.writing.encoding import AccessorData

# Placeholders at unused indices; the next write reuses them.
EMPTY_ACCESSOR: Json = {"componentType": 5121, "count": 1, "type": "SCALAR"}


class PendingIndex(int):
    """An index among the new contents, to be replaced by that of an accessor."""


def insert_accessors(
    document: Document,
    animations: Sequence[Json],
    replaced: Set[int],
    contents: Sequence[AccessorData],
    extension: str = "",
    sources: Sequence[Set[int]] = (),
    unneeded: Set[int] = frozenset(),
) -> Document:
    """Return the document with these animations and the accessors of `contents`.

    The samplers of the animations refer to new contents by `PendingIndex`, else to existing accessors.
    replaced: indices of the animations of `document` that are replaced or gone. sources: for each content, the
    accessors that it replaces: name, extras and index are kept if it replaces exactly one, alone. unneeded: accessors
    to remove too, if nothing refers to them.
    """
    outside = references.references_outside(document.json, replaced)
    old_views = json_array(document.json, "bufferViews")
    freed = _accessors_of(document.json, replaced) | placeholders(document.json) | unneeded
    freed = freed - outside.accessors - _referenced_accessors(animations)
    unused = compaction.unused_views(document, freed, outside) | empty_views(document.json, outside)
    layout = buffer_views.lay_out_views(contents, extension, fallback_buffer.overhead(document.json, extension))
    store = rebuild_buffers(document, freed, unused, outside, layout.views, extension)

    view_slots = IndexAllocator(len(old_views), unused, [0] * len(store.views))
    views = [compaction.relocate_view(view, store.shift) for view in old_views]
    view_slots.fill(views, store.views, {"buffer": store.target, "byteLength": 1})
    kept = _retained_accessors(json_array(document.json, "accessors"), freed, sources)
    accessor_slots = IndexAllocator(
        len(json_array(document.json, "accessors")),
        freed,
        _reference_counts(animations, len(contents)),
        fixed={i: number for i, (number, _) in kept.items()},
    )
    accessors = [
        compaction.relocate_accessor(about, old_views, store.shift) for about in json_array(document.json, "accessors")
    ]
    new = [
        {**each.accessor(view_slots.indices[view], offset), **kept.get(i, (0, {}))[1]}
        for i, (each, (view, offset)) in enumerate(zip(contents, layout.places, strict=True))
    ]
    accessor_slots.fill(accessors, new, EMPTY_ACCESSOR)

    json = dict(document.json)
    _set_list(json, "animations", [_resolve_indices(animation, accessor_slots.indices) for animation in animations])
    _set_list(json, "accessors", accessors)
    _set_list(json, "bufferViews", views)
    _set_list(json, "buffers", store.described)
    fallback_buffer.name_extensions(json, document.json, extension)
    return Document(json, store.buffers, document.chunks, document.indent)


def _retained_accessors(
    accessors: list[Json], freed: Set[int], sources: Sequence[Set[int]]
) -> dict[int, tuple[int, Json]]:
    """By content, the one accessor that it alone replaces, with its name and extras, if any."""
    uses = Counter(number for each in sources for number in each)
    kept: dict[int, tuple[int, Json]] = {}
    for i, each in enumerate(sources):
        number = next(iter(each)) if len(each) == 1 else None
        if number is not None and number in freed and uses[number] == 1:
            words: Json = {key: accessors[number][key] for key in ("name", "extras") if key in accessors[number]}
            kept.update({i: (number, words)} if words else {})
    return kept


def _accessors_of(json: Json, animations: Set[int]) -> set[int]:
    found = json_array(json, "animations")
    return {sampler[key] for i in animations for sampler in found[i]["samplers"] for key in ("input", "output")}


def placeholders(json: Json) -> set[int]:
    """Return the placeholder accessors."""
    return {i for i, accessor in enumerate(json_array(json, "accessors")) if accessor == EMPTY_ACCESSOR}


def empty_views(json: Json, outside: references.References) -> set[int]:
    """Return the placeholder views: of one byte, without references."""
    named = {
        view for accessor in json_array(json, "accessors") for view in references.views_of(accessor)
    } | outside.views
    views = enumerate(json_array(json, "bufferViews"))
    return {i for i, view in views if compaction.is_placeholder(view) and i not in named}


def _reference_counts(animations: Sequence[Json], contents: int) -> list[int]:
    """For each new content, its count of references by samplers."""
    named = [0] * contents
    for animation in animations:
        for sampler in animation["samplers"]:
            for key in ("input", "output"):
                if isinstance(sampler[key], PendingIndex):
                    named[sampler[key]] += 1
    return named


def _referenced_accessors(animations: Sequence[Json]) -> set[int]:
    numbers = (sampler[key] for a in animations for sampler in a["samplers"] for key in ("input", "output"))
    return {number for number in numbers if not isinstance(number, PendingIndex)}


def _resolve_indices(animation: Json, numbers: list[int]) -> Json:
    samplers = [
        {key: numbers[value] if isinstance(value, PendingIndex) else value for key, value in sampler.items()}
        for sampler in animation["samplers"]
    ]
    return {**animation, "samplers": samplers}


def _set_list(json: Json, key: str, objects: list[Json]) -> None:
    if objects:
        json[key] = objects
    elif json.get(key):
        del json[key]


class IndexAllocator:
    """Indices for new objects in a list: freed ones first, then appended ones.

    named: for each new object, its count of references: the shortest indices have the most references.
    fixed: freed indices that are already assigned, by new object.
    """

    def __init__(
        self, length: int, freed: Set[int], named: Sequence[int], *, fixed: Mapping[int, int] = MappingProxyType({})
    ) -> None:
        ordered, count = sorted(freed - set(fixed.values())), len(named) - len(fixed)
        taken = ordered[:count] + list(range(length, length + count - len(ordered)))
        self.indices = [fixed.get(i, 0) for i in range(len(named))]
        others = (i for i in range(len(named)) if i not in fixed)
        for index, i in zip(taken, sorted(others, key=lambda i: -named[i]), strict=True):
            self.indices[i] = index
        self._holes = ordered[count:]

    def fill(self, objects: list[Json], new: list[Json], placeholder: Json) -> None:
        """Store new objects at their indices, in place; remove unused ones or fill in a placeholder."""
        for index, about in sorted(zip(self.indices, new, strict=True), key=lambda pair: pair[0]):
            if index < len(objects):
                objects[index] = about
            else:
                objects.append(about)
        for index in reversed(self._holes):
            if index == len(objects) - 1:
                objects.pop()
            else:
                objects[index] = placeholder
