"""Files that `container.read` refuses, opened as far as they go: for commands that only look."""

from __future__ import annotations

import struct
from contextlib import suppress
from dataclasses import dataclass

from anim.errors import AnimError, FormatError
from anim.gltf.document import Bytes, Document, Json
from anim.gltf.io import container, json_text
from anim.gltf.reading.node_matrix import expand_matrices
from anim.gltf.validation import salvage


@dataclass(frozen=True, slots=True)
class BrokenFile:
    """document: the parts that can be looked at. faults: what is wrong with the rest, never empty.

    lost_clips, lost_skins: numbers of those that nothing can be said about.
    """

    document: Document
    faults: tuple[AnimError, ...]
    lost_clips: frozenset[int]
    lost_skins: frozenset[int]


def read_broken(data: Bytes, resolve: container.Resolve | None, refusal: AnimError) -> BrokenFile:
    """Return what is left of a file. refusal: why it was refused, raised again where its JSON can't be read."""
    try:
        raw, binary = _chunks(data)
        parsed = json_text.parse(raw)
    except FormatError:
        raise refusal from None
    found = salvage.salvage(parsed)
    json, rotations = _drop_zero_rotations(found.json)
    faults = (*found.faults, *rotations)
    if not any(str(refusal) == str(fault) for fault in faults):  # of the container, or a sheared matrix
        faults = (refusal, *faults)
    expanded: tuple[int, ...] = ()
    with suppress(FormatError):  # a shear stays as it is
        json, expanded = expand_matrices(json)
    is_glb = data[:4].tobytes() == container.MAGIC
    buffers = container.buffers_of(json, binary, resolve, glb=is_glb, check=False)
    return BrokenFile(Document(json, buffers, expanded=expanded), faults, found.lost_clips, found.lost_skins)


def unread_buffers(document: Document) -> tuple[AnimError, ...]:
    """Return a fault for each buffer whose bytes can't be had, also where nothing refers to it."""
    faults = []
    for buffer in document.buffers:
        try:
            _ = buffer.data if buffer.has_data else None
        except FormatError as error:
            faults.append(error)
    return tuple(faults)


def _chunks(data: Bytes) -> tuple[bytes, Bytes | None]:
    """The text of the JSON, and the BIN chunk as far as it is there."""
    if data[:4].tobytes() != container.MAGIC:
        return data.tobytes(), None
    json_end, kind = _chunk(data, 12)
    if kind != container.JSON_CHUNK or json_end > len(data):
        raise FormatError("no JSON chunk")
    if len(data) < json_end + 8:
        return data[20:json_end].tobytes(), None
    end, kind = _chunk(data, json_end)
    return data[20:json_end].tobytes(), data[json_end + 8 : end] if kind == container.BIN_CHUNK else None


def _chunk(data: Bytes, start: int) -> tuple[int, int]:
    """Where a chunk ends, and its kind."""
    header = data[start : start + 8].tobytes()
    if len(header) < 8:
        raise FormatError("chunk header is cut off")
    size, kind = struct.unpack("<II", header)
    return start + 8 + size, kind


def _drop_zero_rotations(json: Json) -> tuple[Json, list[AnimError]]:
    """The JSON without rotations that turn nowhere, and a fault for each."""
    faults: list[AnimError] = []
    nodes = list(json.get("nodes", ()))
    for i, node in enumerate(nodes):
        if "rotation" in node and not any(node["rotation"]):
            problem = "rotation is zero (expected a unit quaternion)"
            faults.append(FormatError(problem, where=f"nodes[{i}]"))
            nodes[i] = {key: value for key, value in node.items() if key != "rotation"}
    return ({**json, "nodes": nodes} if faults else json), faults
