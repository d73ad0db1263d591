"""Flip-books of this library in a .glb → VertexCache."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

import numpy as np

from anim.arrays import AnyArray, Floats, Ints
from anim.caches.formats.gltf_flipbook import EXTRAS, NAME
from anim.errors import FormatError
from anim.gltf.document import Document, Json, json_array
from anim.gltf.reading.accessors import Accessors
from anim.gltf.validation import channel_targets
from anim.model import FrameChunk, VertexCache

Page = list[Json]  # primitives of one frame, of all meshes
_NODE_POINTER = re.compile(r"/nodes/(0|[1-9][0-9]{0,8})(?=/|$)")


def read_pages(document: Document) -> VertexCache | None:
    """Return the frames of the flip-books of a document, their vertices one after another; None without any."""
    books: list[list[int]] = []
    up = "y"
    for node in json_array(document.json, "nodes"):
        said = (node.get("extras") or {}).get(EXTRAS) if isinstance(node.get("extras"), dict) else None
        if isinstance(said, dict) and said.get("cache") == NAME:
            books.append(node.get("children", []))
            up = "z" if said.get("up") == "z" else "y"
    return _cache(document, books, up) if books else None


def _cache(document: Document, books: Sequence[Sequence[int]], up: str) -> VertexCache:
    accessors = Accessors(document)
    json = document.json
    try:
        pages = [_primitives(json, children) for children in zip(*books, strict=True)]
        times = _times(json, accessors, books[0])
        counts = [json["accessors"][each["attributes"]["POSITION"]]["count"] for each in pages[0]]
    except (IndexError, KeyError, TypeError, ValueError):
        raise FormatError("is no flip-book as we write them") from None
    if len(times) != len(pages):
        raise FormatError(f"flip-book has {len(pages)} pages and {len(times)} times")
    has_normals, has_tangents = (
        all(name in each["attributes"] for page in pages for each in page) for name in ("NORMAL", "TANGENT")
    )
    handedness = None
    if has_tangents:
        handedness = _rows(accessors, pages[0], "TANGENT", counts)[0, :, 3].astype(np.float64)

    def chunks() -> Iterator[FrameChunk]:
        for i, page in enumerate(pages):
            normals = _rows(accessors, page, "NORMAL", counts) if has_normals else None
            tangents = _rows(accessors, page, "TANGENT", counts)[..., :3] if has_tangents else None
            yield FrameChunk(i, _rows(accessors, page, "POSITION", counts), normals, tangents)

    return VertexCache(
        times,
        sum(counts),
        _faces(accessors, pages[0], counts),
        chunks,
        has_normals=has_normals,
        up=up,
        handedness=handedness,
    )


def _primitives(json: Json, children: Sequence[int]) -> Page:
    """Primitives of the nodes of one frame."""
    return [each for child in children for each in json["meshes"][json["nodes"][child]["mesh"]]["primitives"]]


def _times(json: Json, accessors: Accessors, book: Sequence[int]) -> Floats:
    """Time of each page: its second key; of the first one its first key."""
    samplers: dict[int, int] = {}
    for clip in json_array(json, "animations"):
        for channel in clip["channels"]:
            node = _switched_node(channel)
            if node is not None:
                samplers[node] = clip["samplers"][channel["sampler"]]["input"]
    if book[0] not in samplers:
        return np.zeros(1)
    keys = [accessors.floats(samplers[page])[:, 0] for page in book]
    return np.array([keys[0][0], *(each[1] for each in keys[1:])])


def _switched_node(channel: Json) -> int | None:
    target = channel_targets.channel_target(channel)
    if target is None:
        return None
    if target[0] is not None:
        return target[0]
    match = _NODE_POINTER.match(target[2] or "")
    return int(match[1]) if match else None


def _faces(accessors: Accessors, page: Page, counts: Sequence[int]) -> Ints:
    """Triangles (T, 3) of the primitives of a page; none of points and lines."""
    found = [np.empty((0, 3), np.int64)]
    for each, first in zip(page, np.cumsum([0, *counts]), strict=False):
        if "indices" in each and each.get("mode", 4) == 4:
            found.append(accessors.integers(each["indices"]).reshape(-1, 3) + first)
    return np.concatenate(found)


def _rows(accessors: Accessors, page: Page, name: str, counts: Sequence[int]) -> AnyArray:
    """Rows (1, V, C) of an attribute of a page."""
    rows = [accessors.floats(each["attributes"][name]) for each in page]
    if [len(each) for each in rows] != list(counts):
        raise FormatError(f"a page of the flip-book has {sum(map(len, rows))} vertices (the first has {sum(counts)})")
    return np.concatenate(rows).astype(np.float32)[None]
