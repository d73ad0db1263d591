"""glTF document: the file's JSON, unmodified, and its buffers, loaded on first use."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, TypeAlias

import numpy as np

from anim import arrays
from anim.arrays import Bytes as Bytes
from anim.errors import FormatError

Json: TypeAlias = dict[str, Any]
_CONTAINERS = (dict, list)  # a tuple: `dict | list` takes isinstance three times as long


class Buffer:
    """One buffer, loaded on first use.

    byte_length: as in the JSON; the data may be longer, never shorter.
    uri: as in the JSON; None for the BIN chunk of a GLB, or for a buffer without data.
    replaced: True if the bytes are new; the uri then only tells how the buffer was stored before.
    shortened: the buffer that this one has the bytes of, and the ranges (first byte, end) of it that are dropped.
    """

    def __init__(
        self,
        byte_length: int,
        uri: str | None,
        load: Callable[[], Bytes] | None,
        *,
        where: str = "buffer",
        replaced: bool = False,
        shortened: tuple[Buffer, list[tuple[int, int]]] | None = None,
    ) -> None:
        self.byte_length = byte_length
        self.uri = uri
        self.replaced = replaced
        self.shortened = shortened
        self._load = load
        self._where = where

    def __deepcopy__(self, memo: dict[int, Any]) -> Buffer:
        return self  # immutable

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the bytes themselves: the loader may not work in other processes."""
        data = np.array(self.data) if self.has_data else None
        return _restored, (self.byte_length, self.uri, data, self._where, self.replaced)

    @property
    def has_data(self) -> bool:
        """True if the buffer has bytes; a fallback buffer of compressed views has none."""
        return self._load is not None

    @cached_property
    def data(self) -> Bytes:
        """Bytes (byte_length,), read-only. Raises FormatError if they cannot be read."""
        if self._load is None:
            raise FormatError("has no data (no uri, and no BIN chunk)", where=self._where)
        try:
            data = self._load()
        except FormatError as error:
            raise error.at(self._where, ": ") from None
        if len(data) < self.byte_length:
            raise FormatError(
                f"holds {len(data)} bytes (expected at least its byteLength, {self.byte_length})", where=self._where
            )
        return data[: self.byte_length]


def _restored(byte_length: int, uri: str | None, data: Bytes | None, where: str, replaced: bool) -> Buffer:
    load = None if data is None else partial(arrays.freeze, data)
    return Buffer(byte_length, uri, load, where=where, replaced=replaced)


@dataclass(frozen=True, slots=True)
class Document:
    """A glTF file, immutable.

    json: the whole JSON as parsed, keys in the file's order.
    buffers: one for each of the JSON's `buffers`.
    chunks: unknown chunks of a GLB after JSON and BIN, (type, bytes): kept and written again.
    indent: spaces per level of a .gltf text, None for compact text or a GLB.
    expanded: indices of animated nodes that had a `matrix`; the JSON here has TRS instead.
    """

    json: Json
    buffers: tuple[Buffer, ...]
    chunks: tuple[tuple[int, bytes], ...] = ()
    indent: int | None = None
    expanded: tuple[int, ...] = ()

    def __repr__(self) -> str:
        counts = count_objects(self.json, ("animations", "nodes", "meshes", "skins"))
        return f"Document({counts}, buffer_bytes={sum(each.byte_length for each in self.buffers)})"


def node_label(json: Json, number: int) -> str:
    """Return a node's label for messages: "node 7 'hip'"."""
    name = json_array(json, "nodes")[number].get("name")
    return f"node {number} '{name}'" if name else f"node {number}"


def json_array(json: Json, key: str) -> list[Json]:
    """Return the objects of a top-level array, empty if the file has none."""
    found: list[Json] = json.get(key, [])
    return found


def count_objects(json: Json, keys: Sequence[str]) -> str:
    """Return the lengths of top-level arrays, "nodes=3, meshes=1"; of edited JSON one may be no array: "nodes=?"."""
    found = [(key, json.get(key, [])) for key in keys]
    return ", ".join(f"{key}={len(each) if isinstance(each, list) else '?'}" for key, each in found)


def copy_json(json: Json) -> Json:
    """Return a deep copy that shares no object and no list with `json`."""
    result = json.copy()
    stack: list[Any] = [result]
    while stack:
        parent = stack.pop()
        for key, value in parent.items() if isinstance(parent, dict) else enumerate(parent):
            if isinstance(value, _CONTAINERS):
                parent[key] = own = value.copy()
                stack.append(own)
    return result
