"""Documents of one animation each: as if the others were removed at once, in whatever order they are asked for."""

from __future__ import annotations

import random

import pytest

from anim.caches.source_document.single_clip_sources import SingleClipSources
from anim.gltf.document import Document
from anim.gltf.io import container
from anim.gltf.writing.new_accessors import NewAccessors, edit_document
from tests import many
from tests.files import opened


def alone(document: Document, index: int) -> bytes:
    json = {**document.json, "animations": [document.json["animations"][index]]}
    return stored(edit_document(document, json, NewAccessors(len(json["accessors"]))))


def stored(document: Document) -> bytes:
    return b"".join(piece.tobytes() for piece in container.glb(document))


@pytest.mark.parametrize("make", [many.clips_different, many.clips_equal, many.clips_empty])
def test_documents_are_those_with_the_others_removed(make: many.Make) -> None:
    document = opened(make(13))
    order = [*range(13), *random.Random(1).choices(range(13), k=20)]
    sources = SingleClipSources(document)
    assert all(stored(sources.document(i)) == alone(document, i) for i in order)


def test_a_document_without_animations_is_itself() -> None:
    document = opened(many.clips_empty(0))
    assert SingleClipSources(document).document(0) is document


def test_documents_on_the_way_load_no_bytes() -> None:
    """A large mesh would be in memory once for each of them."""
    document = opened(many.clips_different(16))
    document.json["accessors"][6]["count"] = 3  # of the first clip, not of all
    sources = SingleClipSources(document)
    last = sources.document(5)
    assert stored(last) == alone(document, 5)
    between = [each.buffers[0] for _, _, each in sources._halves[1:-1]]
    assert [each.byte_length for each in between] == [680, 536, 440]  # 48 per clip; the first stays
    assert not any("data" in vars(each) for each in between)
