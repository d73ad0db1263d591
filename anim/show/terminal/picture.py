"""PNG → bytes that a terminal shows as a picture, at most as wide as the terminal."""

from __future__ import annotations

import io
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from anim.arrays import AnyArray
from anim.show.terminal.half_blocks import encode_half_blocks
from anim.show.terminal.inline_png import encode_iterm2, encode_kitty
from anim.show.terminal.sixel import encode_sixel

DEFAULT_CELL_WIDTH_PX = 9  # pixels; most terminals without a report have 8 to 10
MAX_EXTRA_WIDTH_PX = 12  # pixels; more costs time, in terminals that are too narrow anyway


class Protocol(StrEnum):
    """Protocol of pictures in a terminal."""

    KITTY = "kitty"
    ITERM2 = "iterm2"
    SIXEL = "sixel"
    BLOCKS = "blocks"


@dataclass(frozen=True, slots=True)
class TerminalSize:
    """columns: of cells. width: pixels of all columns, 0 if unknown. is_true_color: 24 bits per color."""

    columns: int = 80
    width: int = 0
    is_true_color: bool = True


def encode_picture(png: bytes, protocol: Protocol, size: TerminalSize, *, line_width: int = 0) -> bytes:
    """Return the escape sequences or characters that show a PNG, ending in a new line.

    Wider pictures are reduced to the terminal; for half blocks every picture has at most a pixel per column.
    line_width: pixels of dark lines on a light ground that half blocks must show; 0 for other pictures.
    """
    if protocol is Protocol.BLOCKS:
        fitted = _fitted(_widen_lines(png, size.columns, line_width) if line_width else png, size.columns)
        return encode_half_blocks(_pixels(fitted), is_true_color=size.is_true_color)
    fitted = _fitted(png, size.width or size.columns * DEFAULT_CELL_WIDTH_PX)
    if protocol is Protocol.SIXEL:
        return encode_sixel(_pixels(fitted))
    return encode_kitty(fitted) if protocol is Protocol.KITTY else encode_iterm2(fitted)


def _widen_lines(png: bytes, width: int, line_width: int) -> bytes:
    """The PNG with dark lines as wide as a pixel is after the reduction to `width` pixels."""
    from PIL import Image, ImageFilter

    image = Image.open(io.BytesIO(png)).convert("RGB")
    extra = min(image.width // width - line_width, MAX_EXTRA_WIDTH_PX)
    if extra < 1:
        return png
    out = io.BytesIO()
    image.filter(ImageFilter.MinFilter(extra // 2 * 2 + 1)).save(out, "PNG", compress_level=1)
    return out.getvalue()


def _fitted(png: bytes, width: int) -> bytes:
    """The PNG, or a smaller one of this width."""
    from PIL import Image

    image = Image.open(io.BytesIO(png))
    if image.width <= width:
        return png
    height = max(round(image.height * width / image.width), 1)
    out = io.BytesIO()
    image.convert("RGB").resize((width, height), Image.Resampling.LANCZOS).save(out, "PNG")
    return out.getvalue()


def _pixels(png: bytes) -> AnyArray:
    from PIL import Image

    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))
