"""Read the valid parts of files that `container.read` rejects, for read-only commands."""

from __future__ import annotations

import struct
from contextlib import suppress
from typing import NamedTuple

from anim.errors import AnimError, FormatError
from anim.gltf.document import Bytes, Document, Json
from anim.gltf.io import container, json_text
from anim.gltf.io.buffers import Resolve, buffers_of
from anim.gltf.reading.node_matrix import expand_matrices


class BrokenFile(NamedTuple):
    """document: the valid parts. faults: errors in the rest, never empty.

    lost_clips, lost_skins: indices of those that cannot be read at all.
    """

    document: Document
    faults: tuple[AnimError, ...]
    lost_clips: frozenset[int]
    lost_skins: frozenset[int]


def read_broken(data: Bytes, resolve: Resolve | None, refusal: AnimError) -> BrokenFile:
    """Return the valid parts of a file. refusal: its error, raised again for unreadable JSON."""
    from anim.gltf.validation import salvage

    try:
        raw, binary = _chunks(data)
        parsed = json_text.parse(json_text.skip_mark(raw))
    except FormatError:
        raise refusal from None
    found = salvage.salvage(parsed)
    json, rotations = _drop_zero_rotations(found.json)
    faults = (*found.faults, *rotations)
    if not any(str(refusal) == str(fault) for fault in faults):  # of the container, or a sheared matrix
        faults = (refusal, *faults)
    expanded: tuple[int, ...] = ()
    with suppress(FormatError):  # a sheared matrix is kept
        json, expanded = expand_matrices(json)
    is_glb = data[:4].tobytes() == container.MAGIC
    buffers = buffers_of(json, binary, resolve, glb=is_glb, check=False)
    return BrokenFile(Document(json, buffers, expanded=expanded), faults, found.lost_clips, found.lost_skins)


def unread_buffers(document: Document) -> tuple[AnimError, ...]:
    """Return a fault for each buffer with unreadable bytes, also if nothing refers to it."""
    faults = []
    for buffer in document.buffers:
        try:
            _ = buffer.data if buffer.has_data else None
        except FormatError as error:
            faults.append(error)
    return tuple(faults)


def _chunks(data: Bytes) -> tuple[bytes, Bytes | None]:
    """The text of the JSON, and the BIN chunk as far as the file contains it."""
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
    """End offset and type of a chunk."""
    header = data[start : start + 8].tobytes()
    if len(header) < 8:
        raise FormatError("chunk header is cut off")
    size, kind = struct.unpack("<II", header)
    return start + 8 + size, kind


def _drop_zero_rotations(json: Json) -> tuple[Json, list[AnimError]]:
    """The JSON without rotations of length zero, and a fault for each."""
    faults: list[AnimError] = []
    nodes = list(json.get("nodes", ()))
    for i, node in enumerate(nodes):
        if "rotation" in node and not any(node["rotation"]):
            problem = "rotation is zero (expected a unit quaternion)"
            faults.append(FormatError(problem, where=f"nodes[{i}]"))
            nodes[i] = {key: value for key, value in node.items() if key != "rotation"}
    return ({**json, "nodes": nodes} if faults else json), faults
