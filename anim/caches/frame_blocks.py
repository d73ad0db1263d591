"""Raw frame data after a header, as in PC2 and MDD, a chunk at a time."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from typing import BinaryIO

import numpy as np

from anim.caches.storage import COPY_BYTES, Inputs, read_exactly, size_of
from anim.errors import FormatError
from anim.model import FrameChunk, VertexCache


def check_size(file: BinaryIO, header: int, frames: int, vertices: int) -> None:
    """Raise FormatError unless a file's size matches its header, frame and vertex counts."""
    if frames < 1 or vertices < 1:
        raise FormatError(f"header says {frames} frames of {vertices} points (expected at least one)")
    expected, found = header + 12 * frames * vertices, size_of(file)
    if found < expected:
        raise FormatError(f"is truncated: {found} bytes (expected {expected} for {frames} frames of {vertices} points)")
    if found > expected:
        raise FormatError(f"has {found - expected} bytes too many for {frames} frames of {vertices} points")


def chunks(inputs: Inputs, header: int, frames: int, vertices: int, dtype: str) -> Iterator[FrameChunk]:
    """Yield the frames of the main file, float32 of `dtype` ("<f4" or ">f4") after the header."""
    step = per_chunk(vertices)
    with inputs.open(inputs.main) as file:
        file.seek(header)
        for first in range(0, frames, step):
            count = min(step, frames - first)
            data = read_exactly(file, 12 * count * vertices, f"frame {first}")
            positions = np.frombuffer(data, dtype).reshape(count, vertices, 3).astype(np.float32, copy=False)
            if not np.isfinite(positions).all():
                bad = first + int(np.argmin(np.isfinite(positions).all(axis=(1, 2))))
                raise FormatError(f"frame {bad} holds NaN or infinity")
            yield FrameChunk(first, positions)


def write(cache: VertexCache, file: BinaryIO, dtype: str) -> str:
    """Write all positions as float32 of `dtype`, and return the fingerprint of the first frame."""
    mark = ""
    for chunk in cache.chunks():
        rows = np.ascontiguousarray(chunk.positions, dtype)
        mark = mark or _mark(rows[0].tobytes(), cache.frame_count)
        file.write(rows.data)
    return mark


def fingerprint(inputs: Inputs, header: int, frames: int, vertices: int) -> str:
    """Return the fingerprint of the first frame, by which a rest mesh identifies its cache."""
    with inputs.open(inputs.main) as file:
        file.seek(header)
        return _mark(read_exactly(file, 12 * vertices, "frame 0"), frames)


def _mark(frame: bytes, frames: int) -> str:
    return f"{zlib.crc32(frame, frames):08x}"


def per_chunk(vertices: int) -> int:
    """Return the frame count of a chunk."""
    return max(1, COPY_BYTES // max(12 * vertices, 1))
