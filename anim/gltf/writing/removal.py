"""Remove animations and accessors with their bytes; all other indices but those of later animations stay."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import replace

from anim.gltf.document import Document, json_array
from anim.gltf.writing.insertion import insert_accessors


def remove_animations(document: Document, numbers: Set[int]) -> Document:
    """Return the document without animations by index, and without the accessors that only they use."""
    left = [each for i, each in enumerate(json_array(document.json, "animations")) if i not in numbers]
    removed = insert_accessors(document, left, numbers, ())
    json = {key: value for key, value in removed.json.items() if key != "animations" or value}
    return replace(removed, json=json)


def remove_unused_accessors(document: Document, numbers: Set[int]) -> Document:
    """Return the document without those accessors by index that nothing refers to."""
    return insert_accessors(document, json_array(document.json, "animations"), frozenset(), (), unneeded=numbers)
