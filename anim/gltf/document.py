"""Document: the file's own JSON, verbatim, and its buffers, opened only when something in them is needed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, TypeAlias

import numpy as np

from anim import arrays
from anim.arrays import Bytes as Bytes
from anim.errors import FormatError

Json: TypeAlias = dict[str, Any]


class Buffer:
    """One buffer: a promise of bytes that is kept on first use.

    byte_length: as the JSON says; the bytes behind may be longer, never shorter.
    uri: where the JSON says they are: None for the BIN chunk of a GLB, or for a buffer without bytes.
    replaced: whether the bytes are new, so that the uri only says how they were kept.
    """

    def __init__(
        self,
        byte_length: int,
        uri: str | None,
        load: Callable[[], Bytes] | None,
        *,
        where: str = "buffer",
        replaced: bool = False,
    ) -> None:
        self.byte_length = byte_length
        self.uri = uri
        self.replaced = replaced
        self._load = load
        self._where = where

    def __deepcopy__(self, memo: dict[int, Any]) -> Buffer:
        return self  # nothing in it changes

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the bytes themselves, for other processes: what loads them may be tied to this one."""
        data = np.array(self.data) if self.has_data else None
        return _restored, (self.byte_length, self.uri, data, self._where, self.replaced)

    @property
    def has_data(self) -> bool:
        """Whether there are bytes behind it: a fallback buffer of compressed views has none."""
        return self._load is not None

    @cached_property
    def data(self) -> Bytes:
        """The bytes (byte_length,), read-only. Raises FormatError where they can't be had."""
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
    """A glTF file as it stands: never mutated.

    json: the whole JSON as parsed, keys in the file's order.
    buffers: one for each of the JSON's `buffers`.
    chunks: unknown chunks of a GLB after JSON and BIN, (type, bytes): kept and written again.
    indent: spaces per level of a .gltf text, None where it was compact or a GLB.
    expanded: numbers of nodes that had a `matrix` although a channel animates them; the JSON here has TRS instead.
    """

    json: Json
    buffers: tuple[Buffer, ...]
    chunks: tuple[tuple[int, bytes], ...] = ()
    indent: int | None = None
    expanded: tuple[int, ...] = ()

    def __repr__(self) -> str:
        counts = ", ".join(
            f"{key}={len(json_array(self.json, key))}" for key in ("animations", "nodes", "meshes", "skins")
        )
        return f"Document({counts}, buffer_bytes={sum(each.byte_length for each in self.buffers)})"


def node_label(json: Json, number: int) -> str:
    """Return how messages call a node: "node 7 'hip'"."""
    name = json_array(json, "nodes")[number].get("name")
    return f"node {number} '{name}'" if name else f"node {number}"


def json_array(json: Json, key: str) -> list[Json]:
    """Return the objects of a top-level array, empty where the file has none."""
    found: list[Json] = json.get(key, [])
    return found


def copy_json(json: Json) -> Json:
    """Return a copy that shares no object and no list with `json`, however deep it is nested."""
    result = dict(json)
    stack: list[Any] = [result]
    while stack:
        parent = stack.pop()
        for key, value in list(parent.items()) if isinstance(parent, dict) else enumerate(parent):
            if isinstance(value, dict | list):
                parent[key] = value.copy()
                stack.append(parent[key])
    return result
