"""A source document without animations, for the many files of a run that have none."""

from __future__ import annotations

from anim.gltf.document import Document, json_array
from anim.gltf.writing.new_accessors import NewAccessors, edit_document


def without_animations(document: Document) -> Document:
    """Return a document without animations and the accessors that only they use."""
    if not json_array(document.json, "animations"):
        return document
    kept = {key: value for key, value in document.json.items() if key != "animations"}
    return edit_document(document, kept, NewAccessors(len(json_array(document.json, "accessors"))))
