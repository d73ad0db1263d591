"""Accessors that overlap in their buffer: a small file can hold many numbers that way."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from anim.gltf.document import Buffer, Json
from anim.gltf.validation import buffer_layout


def unbacked_bytes(accessors: Iterable[Json], views: Sequence[Json], buffers: Sequence[Buffer]) -> int:
    """Return the bytes, as float64, of the numbers beyond those that fit beside each other into the buffers.

    accessors, views: their JSON, valid. All numbers of accessors without a view are beyond them.
    (two accessors of the same 120 bytes, 30 floats, in a buffer of 120) → 240
    """
    stored: dict[int, int] = {}
    decoded: dict[int, int] = {}
    found = 0
    for about in accessors:
        columns, rows = buffer_layout.COMPONENTS.get(about["type"], (0, 0))
        size = about["count"] * columns * rows
        if "bufferView" not in about:
            found += 8 * size
            continue
        number = views[about["bufferView"]]["buffer"]
        stored[number] = stored.get(number, 0) + buffer_layout.COMPONENT_SIZES[about["componentType"]] * size
        decoded[number] = decoded.get(number, 0) + 8 * size
    for number, length in stored.items():
        if length > buffers[number].byte_length:
            found += decoded[number] * (length - buffers[number].byte_length) // length
    return found
