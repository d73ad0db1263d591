"""Pixels as sixels: six rows of pixels at a time, one pass per color, in run lengths (DEC VT340)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from anim.arrays import AnyArray, Ints

MAX_COLORS = 256  # registers of the terminals that show sixels
ROWS = 6  # of pixels in a sixel
FIRST_CHARACTER = 63  # "?", a sixel without pixels
MIN_RUN = 4  # characters; shorter runs take less space as they are


def encode_sixel(image: AnyArray) -> bytes:
    """Return the escape sequence of a picture (H, W, 3) of 8 bits per channel.

    Its colors are reduced to 256, without dithering. Color registers are in percent.
    """
    height, width = image.shape[:2]
    indices, palette = _quantize(image)
    percent = np.rint(palette / 255 * 100).astype(int).tolist()
    colors = "".join(f"#{i};2;{r};{g};{b}" for i, (r, g, b) in enumerate(percent))
    bands = [_band(indices[top : top + ROWS]) for top in range(0, height, ROWS)]
    return f'\x1bP0;1;0q"1;1;{width};{height}{colors}{"-".join(bands)}\x1b\\\n'.encode("ascii")


def _quantize(image: AnyArray) -> tuple[Ints, Ints]:
    """Color indices (H, W), and the palette (n, 3)."""
    from PIL import Image

    reduced = Image.fromarray(image).quantize(MAX_COLORS, dither=Image.Dither.NONE)
    indices = np.asarray(reduced, np.int64)
    palette = np.array(reduced.getpalette(), np.int64).reshape(-1, 3)
    return indices, palette[: indices.max() + 1]


def _band(rows: Ints) -> str:
    """Sixels of up to six rows: all of one color, back to the left, all of the next."""
    bits = 1 << np.arange(len(rows))[:, None]
    used = np.unique(rows)
    return "$".join(f"#{color}{''.join(_runs(((rows == color) * bits).sum(axis=0)))}" for color in used.tolist())


def _runs(sixels: Ints) -> Iterator[str]:
    """Run lengths of sixels, without the empty ones at the end."""
    starts = np.flatnonzero(np.diff(sixels, prepend=-1))
    lengths = np.diff(starts, append=len(sixels))
    values = sixels[starts].tolist()
    for i, (value, count) in enumerate(zip(values, lengths.tolist(), strict=True)):
        if value == 0 and i == len(values) - 1:
            return
        character = chr(FIRST_CHARACTER + value)
        yield character * count if count < MIN_RUN else f"!{count}{character}"
