"""Text of a .gltf again as it was: indent, and the place of each buffer, after a way through GLB."""

from __future__ import annotations

from dataclasses import replace

from anim.gltf.document import Buffer, Document, Json, json_array
from anim.gltf.io import uri


def restore_text_form(document: Document, text: Document) -> Document:
    """Return a document, read from a GLB, in the form of the .gltf that it was made from.

    Buffers that were data URIs become such again, others are files; both versions number them alike. Keys of a buffer
    have their old order.
    """
    before = json_array(text.json, "buffers")
    old = [*zip(before, text.buffers, strict=True), *[None] * len(document.buffers)]
    new = [
        (about, buffer) if pair is None else (_ordered(about, pair[0]), _stored_as(buffer, pair[1]))
        for about, buffer, pair in zip(json_array(document.json, "buffers"), document.buffers, old, strict=False)
    ]
    json = {**document.json, "buffers": [about for about, _ in new]} if new else document.json
    return replace(document, json=json, buffers=tuple(buffer for _, buffer in new), indent=text.indent)


def _ordered(about: Json, before: Json) -> Json:
    """The keys in their old order, with a place for the URI."""
    return {key: about.get(key) for key in before if key in about or key == "uri"} | about


def _stored_as(buffer: Buffer, before: Buffer) -> Buffer:
    if not buffer.has_data or before.uri is None:
        return buffer
    address = before.uri if uri.is_data(before.uri) else None
    return Buffer(buffer.byte_length, address, lambda: buffer.data, replaced=True)
