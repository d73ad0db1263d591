"""Accessor contents → buffer views: grouping, order and compression by size."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import group_indices
from anim.gltf.document import Json
from anim.gltf.io import json_text
from anim.gltf.meshopt import codec, stream_order
from anim.gltf.writing.encoding import AccessorData

TYPICAL_OFFSET_BYTES = 10_000  # typical offset or length, to estimate the cost of its digits
PLAIN_VIEW_JSON_BYTES = 50  # JSON bytes of the plain view


class View(NamedTuple):
    """A new view: the bytes to store, and their decoded layout.

    length: decoded bytes. stride: bytes per element of a compressed stream, 0 for a plain view.
    """

    stored: bytes
    length: int
    stride: int = 0
    filter: str = "NONE"

    def about(self, place: tuple[int, int], decoded: tuple[int, int], extension: str) -> Json:
        """Return the JSON. place, decoded: (buffer, offset) of the stored and of the decoded bytes."""
        if not self.stride:
            return {**_at(place), "byteLength": self.length}
        stream = {**_at(place), "byteLength": len(self.stored), "byteStride": self.stride}
        stream |= {"count": self.length // self.stride, "mode": "ATTRIBUTES"}
        if self.filter != "NONE":
            stream["filter"] = self.filter
        return {**_at(decoded), "byteLength": self.length, "extensions": {extension: stream}}


class Layout(NamedTuple):
    """New views, and for each content (view index, byte offset)."""

    views: tuple[View, ...]
    places: tuple[tuple[int, int], ...]


class _Stream(NamedTuple):
    """A view under construction, and its contents in order."""

    view: View
    members: tuple[int, ...]


def lay_out_views(contents: Sequence[AccessorData], extension: str, overhead: int) -> Layout:
    """Return the layout of all contents: one plain view, and compressed views where they are smaller.

    overhead: bytes of the first compressed view besides its own JSON and data.
    """
    streams = _choose_streams(contents, extension, overhead) if extension else []
    apart = {i for stream in streams for i in stream.members}
    rest = tuple(i for i in range(len(contents)) if i not in apart)
    if rest:
        data = b"".join(_pad_rows(contents[i].data) for i in rest)
        streams = [_Stream(View(data, len(data)), rest), *streams]
    places: dict[int, tuple[int, int]] = {}
    for number, stream in enumerate(streams):
        at = 0
        for i in stream.members:
            places[i] = (number, at)
            at += len(_pad_rows(contents[i].data))
    return Layout(tuple(each.view for each in streams), tuple(places[i] for i in range(len(contents))))


def _choose_streams(contents: Sequence[AccessorData], extension: str, overhead: int) -> list[_Stream]:
    """The compressed streams that give the fewest bytes of data and JSON in total."""
    streams = [
        s for members in group_indices(map(_kind, contents)).values() for s in _streams(contents, members, extension)
    ]
    gains = [stream.view.length - _price(stream.view, extension) for stream in streams]
    good = [stream for stream, gain in zip(streams, gains, strict=True) if gain > 0]
    # If nothing remains for the plain view, its JSON is saved too.
    candidates = [([], 0), (good, sum(gain for gain in gains if gain > 0) - overhead)]
    candidates.append((streams, sum(gains) - overhead + PLAIN_VIEW_JSON_BYTES))
    return max(candidates, key=lambda candidate: candidate[1])[0]


def _kind(content: AccessorData) -> tuple[str, int]:
    """The filter, and the bytes per element, a multiple of four."""
    return content.filtered.name if content.filtered else "NONE", content.element_size + -content.element_size % 4


def _streams(contents: Sequence[AccessorData], members: Sequence[int], extension: str) -> list[_Stream]:
    """Streams of the members: one of elements, or several of whole keys.

    In streams of keys each weight is predicted from the same weight of the previous key.
    """
    name, stride = _kind(contents[members[0]])
    one = [_encode(contents, members, name, stride, extension)]
    by_key: dict[int, list[int]] = {}
    for i in members:
        by_key.setdefault(codec.row_size(contents[i].key_size, stride), []).append(i)
    if list(by_key) == [stride]:
        return one
    several = [_encode(contents, each, name, wide, extension) for wide, each in by_key.items()]
    return min(one, several, key=lambda streams: sum(_price(each.view, extension) for each in streams))


def _encode(
    contents: Sequence[AccessorData], members: Sequence[int], name: str, stride: int, extension: str
) -> _Stream:
    codes = [_codes(contents[i]) for i in members]
    order = stream_order.order_contents(codes, stride, extension)
    data = b"".join(codes[k] for k in order)
    stored = codec.encode(np.frombuffer(data, np.uint8).reshape(-1, stride), extension)
    return _Stream(View(stored, len(data), stride, name), tuple(members[k] for k in order))


def _codes(content: AccessorData) -> bytes:
    return content.filtered.codes if content.filtered else _pad_rows(content.data)


def _price(view: View, extension: str) -> int:
    """Bytes of a compressed view, including its JSON with the comma."""
    about = view.about((0, TYPICAL_OFFSET_BYTES), (1, TYPICAL_OFFSET_BYTES), extension)
    return _size(view.stored) + len(json_text.dump(about)) + 1


def _size(data: bytes) -> int:
    return len(data) + -len(data) % 4


def _pad_rows(data: bytes) -> bytes:
    return data + bytes(-len(data) % 4)


def _at(place: tuple[int, int]) -> Json:
    buffer, offset = place
    return {"buffer": buffer, "byteOffset": offset} if offset else {"buffer": buffer}


def total(views: Iterable[View]) -> int:
    """Return the bytes of the views in a buffer, each aligned to four."""
    return sum(_size(view.stored) for view in views)
