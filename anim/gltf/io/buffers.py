"""Buffers of a document: the BIN chunk, data URIs and files, whose bytes are read on first use."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import TypeAlias

import numpy as np

from anim.errors import FormatError, ShapeError
from anim.files.resolver import CompanionFiles
from anim.gltf.document import Buffer, Bytes, Json, json_array
from anim.gltf.io import uri

Resolve: TypeAlias = Callable[[str], Bytes | bytes | bytearray | memoryview]


def buffers_of(
    parsed: Json, binary: Bytes | None, resolve: Resolve | None, *, glb: bool, check: bool = True
) -> tuple[Buffer, ...]:
    """Return the buffers of a JSON.

    check: raise FormatError for a BIN chunk that is missing or shorter than the first buffer.
    """
    buffers, lengths = [], dict[str, int]()
    for about in json_array(parsed, "buffers"):
        address = about.get("uri", "")
        lengths[address] = max(lengths.get(address, 0), about["byteLength"])
    for i, about in enumerate(json_array(parsed, "buffers")):
        load, where = _loader(about, binary if i == 0 else None, resolve, lengths), f"buffer {i}"
        buffers.append(Buffer(about["byteLength"], about.get("uri"), load, where=where))
        if check and glb and i == 0 and "uri" not in about:
            _check_binary(about, binary)
    return tuple(buffers)


def _loader(
    about: Json, binary: Bytes | None, resolve: Resolve | None, lengths: Mapping[str, int]
) -> Callable[[], Bytes] | None:
    address = about.get("uri")
    if address is None:
        return None if binary is None else lambda: binary
    if uri.is_data(address):
        return lambda: as_bytes(uri.decode_data(address))
    return lambda: _read_external(address, resolve, lengths[address])


def _read_external(address: str, resolve: Resolve | None, length: int) -> Bytes:
    """The bytes of a file. length: the largest byteLength of its buffers: a file may be longer by gigabytes."""
    path = uri.relative_path(address)
    if resolve is None:
        raise FormatError(
            f"the bytes of '{path}' are not given",
            help="container.read(data, resolve=…) takes a function that reads it",
        )
    given = resolve.open(path, length) if isinstance(resolve, CompanionFiles) else resolve(path)
    data = as_array(given)
    if data is None:
        raise ShapeError(
            f"resolve gives {describe_type(given)} for '{path}' (expected a uint8 array or bytes)",
            help="raise FormatError in resolve where there is no such file",
        )
    return data


def _check_binary(about: Json, binary: Bytes | None) -> None:
    if binary is None:
        if about.get("extensions") or "fallback" in json.dumps(about):
            return
        raise FormatError("has no uri and the GLB has no BIN chunk", where="buffer 0")
    if len(binary) < about["byteLength"]:
        raise FormatError(
            f"BIN chunk holds {len(binary)} bytes (expected at least byteLength, {about['byteLength']})",
            where="buffer 0",
        )


def as_array(data: object) -> Bytes | None:
    """Return bytes, or an array of bytes (N,), as an array without a copy; None for anything else."""
    if isinstance(data, (bytes, bytearray, memoryview)):
        return as_bytes(data)
    return data if isinstance(data, np.ndarray) and data.dtype == np.uint8 and data.ndim == 1 else None


def describe_type(value: object) -> str:
    """Return the type of a value in words: "an array of float64 with shape (2, 3)", "str"."""
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype} with shape {value.shape}"
    return "None" if value is None else type(value).__name__


def as_bytes(content: bytes | bytearray | memoryview) -> Bytes:
    """Return bytes as an array (N,), without a copy."""
    return np.frombuffer(content, np.uint8)
