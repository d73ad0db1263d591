"""PNG of 16 bits a channel ↔ pixels, by pypng: Pillow does not support RGB of 16 bits."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Iterator
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from anim.errors import FormatError, UnsupportedError

SIGNATURE = b"\x89PNG\r\n\x1a\n"
HEADER_BYTES = 33  # signature and the first chunk, IHDR
BLOCK_BYTES = 1 << 20  # unpacked at a time
BIT_DEPTH = 16
COMPRESSION_LEVEL = 6

Pixels = NDArray[np.uint16]


def write(bands: Iterable[Pixels], file: BinaryIO, *, width: int, height: int) -> None:
    """Write pixels from bands (rows, width, 3) in top-down order."""
    import png

    writer = png.Writer(width, height, greyscale=False, bitdepth=BIT_DEPTH, compression=COMPRESSION_LEVEL)
    writer.write_packed(file, _rows(bands))


def read(data: bytes, *, width: int, height: int) -> Pixels:
    """Return the pixels (height, width, 3) of an RGB file of 16 bits, of any program.

    Raises FormatError for a damaged file or another size, UnsupportedError for other kinds of PNG.
    """
    import png

    try:
        _check_header(data, width, height)
        _check_unpacked_size(data, width, height)
        found_width, found_height, rows, info = png.Reader(bytes=data).read()
        depth, channels = info["bitdepth"], info["planes"]
        if (depth, channels) != (BIT_DEPTH, 3):
            raise UnsupportedError(f"PNG has {channels} channels of {depth} bits (expected 3 of {BIT_DEPTH})")
        pixels = np.array([np.frombuffer(row, np.uint16) for row in rows], np.uint16)
    except (png.Error, zlib.error, EOFError, ValueError, IndexError, TypeError, struct.error) as error:
        raise FormatError(f"PNG is damaged ({' '.join(str(error).split())})") from None
    if (found_width, found_height, pixels.size) != (width, height, width * height * 3):
        raise FormatError(f"PNG is truncated ({len(pixels)} rows of {height})")
    return pixels.reshape(height, width, 3)


def _check_header(data: bytes, width: int, height: int) -> None:
    """Raise FormatError unless the header is that of an image of this size."""
    size, kind, found_width, found_height = struct.unpack_from(">I4sII", data.ljust(HEADER_BYTES, b"\0"), 8)
    if data[:8] != SIGNATURE or kind != b"IHDR" or size != 13 or len(data) < HEADER_BYTES:
        raise FormatError("PNG is damaged (it has no header)")
    if (found_width, found_height) != (width, height):
        raise FormatError(f"PNG has {found_width} × {found_height} pixels (expected {width} × {height})")


def _check_unpacked_size(data: bytes, width: int, height: int) -> None:
    """Raise FormatError for compressed data of more bytes than the pixels have: pypng unpacks all of it."""
    most = 2 * height * (1 + 8 * width)  # of any kind of pixel; interlaced images have more rows
    unpack, size = zlib.decompressobj(), 0
    for block in _compressed(data):
        while block and size <= most:
            size += len(unpack.decompress(block, BLOCK_BYTES))
            block = unpack.unconsumed_tail
    if size > most:
        raise FormatError(f"PNG is damaged (it unpacks to more than {most} bytes)")


def _compressed(data: bytes) -> Iterator[bytes]:
    """Yield the contents of the IDAT chunks."""
    at = len(SIGNATURE)
    while at + 8 <= len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        if kind == b"IDAT":
            yield data[at + 8 : at + 8 + size]
        at += 12 + size


def _rows(bands: Iterable[Pixels]) -> Iterator[bytes]:
    for band in bands:
        for row in np.ascontiguousarray(band, ">u2"):
            yield row.tobytes()
