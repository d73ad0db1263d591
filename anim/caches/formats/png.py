"""PNG of 16 bits a channel ↔ pixels, by pypng: Pillow does not support RGB of 16 bits."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from anim.errors import FormatError, UnsupportedError

BIT_DEPTH = 16
COMPRESSION_LEVEL = 6

Pixels = NDArray[np.uint16]


def write(bands: Iterable[Pixels], file: BinaryIO, *, width: int, height: int) -> None:
    """Write pixels from bands (rows, width, 3) in top-down order."""
    import png

    writer = png.Writer(width, height, greyscale=False, bitdepth=BIT_DEPTH, compression=COMPRESSION_LEVEL)
    writer.write_packed(file, _rows(bands))


def read(data: bytes) -> Pixels:
    """Return the pixels (height, width, 3) of an RGB file of 16 bits, of any program.

    Raises FormatError for a damaged file, UnsupportedError for other kinds of PNG.
    """
    import png

    try:
        width, height, rows, info = png.Reader(bytes=data).read()
        depth, channels = info["bitdepth"], info["planes"]
        if (depth, channels) != (BIT_DEPTH, 3):
            raise UnsupportedError(f"PNG has {channels} channels of {depth} bits (expected 3 of {BIT_DEPTH})")
        pixels = np.array([np.frombuffer(row, np.uint16) for row in rows], np.uint16)
    except (png.Error, zlib.error, EOFError) as error:
        raise FormatError(f"PNG is damaged ({error})") from None
    if pixels.size != height * width * 3:
        raise FormatError(f"PNG is truncated ({len(pixels)} rows of {height})")
    return pixels.reshape(height, width, 3)


def _rows(bands: Iterable[Pixels]) -> Iterator[bytes]:
    for band in bands:
        for row in np.ascontiguousarray(band, ">u2"):
            yield row.tobytes()
