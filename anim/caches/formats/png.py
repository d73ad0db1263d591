"""PNG of 16 bits a channel ↔ rows of numbers: what Pillow can't write (RGB), in as little as the format needs.

Rows are differences from the row above (filter 2, "up"), which suits frames under each other, and deflated.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from anim.errors import FormatError, UnsupportedError

SIGNATURE = b"\x89PNG\r\n\x1a\n"
RGB, DEPTH = 2, 16
NONE, SUB, UP = range(3)
LEVEL = 6

Pixels = NDArray[np.uint16]


def write(bands: Iterable[Pixels], file: BinaryIO, *, width: int, height: int) -> None:
    """Write pixels that come as bands (rows, width, 3) from the top down."""
    file.write(SIGNATURE + _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, DEPTH, RGB, 0, 0, 0)))
    packer = zlib.compressobj(LEVEL)
    above = np.zeros((1, width * 6), np.uint8)
    for band in bands:
        rows = np.ascontiguousarray(band, ">u2").view(np.uint8).reshape(len(band), -1)
        lines = np.full((len(rows), 1 + rows.shape[1]), UP, np.uint8)
        lines[:, 1:] = rows - np.concatenate((above, rows[:-1]))
        above = rows[-1:]
        if data := packer.compress(lines.tobytes()):
            file.write(_chunk(b"IDAT", data))
    file.write(_chunk(b"IDAT", packer.flush()) + _chunk(b"IEND", b""))


def read(data: bytes) -> Pixels:
    """Return the pixels (height, width, 3) of a file as `write` makes them.

    Raises FormatError for a damaged file, UnsupportedError for other kinds of PNG.
    """
    if not data.startswith(SIGNATURE):
        raise FormatError(f"is no PNG: starts with {data[:8]!r}")
    packed, header = bytearray(), b""
    at = len(SIGNATURE)
    while at + 12 <= len(data):
        size, kind = struct.unpack(">I4s", data[at : at + 8])
        body, check = data[at + 8 : at + 8 + size], data[at + 8 + size : at + 12 + size]
        if len(body) < size or check != struct.pack(">I", zlib.crc32(kind + body)):
            raise FormatError(f"chunk {kind!r} at byte {at} is damaged")
        header = body if kind == b"IHDR" else header
        packed += body if kind == b"IDAT" else b""
        at += 12 + size
        if kind == b"IEND":
            return _pixels(header, bytes(packed))
    raise FormatError("PNG is truncated (there is no IEND)")


def _pixels(header: bytes, packed: bytes) -> Pixels:
    width, height, depth, kind, _, _, interlace = struct.unpack(">IIBBBBB", header)
    if (depth, kind, interlace) != (DEPTH, RGB, 0):
        raise UnsupportedError(f"PNG has {depth} bits of color type {kind} (expected RGB of 16 bits)")
    try:
        data = zlib.decompress(packed)
    except zlib.error as error:
        raise FormatError(f"PNG is damaged ({error})") from None
    if len(data) != height * (1 + 6 * width):
        raise FormatError(f"PNG holds {len(data)} bytes of {height * (1 + 6 * width)}")
    lines = np.frombuffer(data, np.uint8).reshape(height, 1 + 6 * width)
    filters, rows = lines[:, 0], lines[:, 1:].copy()
    if filters.max(initial=0) > UP:
        raise UnsupportedError("PNG was saved anew by another program (filters that are not handled)")
    sub = filters == SUB
    rows[sub] = np.cumsum(rows[sub].reshape(-1, width, 6), axis=1, dtype=np.uint8).reshape(-1, 6 * width)
    for y in np.flatnonzero(filters == UP).tolist():
        if y:
            rows[y] += rows[y - 1]
    return rows.view(">u2").astype(np.uint16).reshape(height, width, 3)


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
