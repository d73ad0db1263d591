"""Text in pictures: titles, row names, times, and the color legend."""

from __future__ import annotations

import math
from bisect import bisect_right
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from anim.show.filmstrip import palette
from anim.show.filmstrip.renderer import to_srgb

if TYPE_CHECKING:
    from PIL.ImageFont import FreeTypeFont

INK, FAINT = (56, 58, 62), (120, 123, 128)  # sRGB
FONT_SIZE = 14  # pixels of an em
LINE = 19  # pixels from one line of text to the next
BAR = 120, 8  # pixels of the heat's legend
MAX_LINES = 3  # of a heading
MAX_TITLE = 1024  # pixels; a picture is not made wider for a longer one
ELLIPSIS = "..."  # in ASCII, which the font has
SPACE = 40  # pixels between title and legend

Image = NDArray[np.uint8]


def write(image: Image, text: str, x: int, y: int, *, color: tuple[int, int, int] = INK) -> None:
    """Write a text with the top left of its line at x, y pixels, clipped to the image."""
    from PIL import Image as Pillow
    from PIL import ImageDraw

    stencil = Pillow.new("L", (max(width(text), 1), LINE))
    ImageDraw.Draw(stencil).text((0, 0), _printable(text), fill=255, font=_font())
    coverage = np.asarray(stencil)
    top, left = max(y, 0), max(x, 0)
    inside = image[top : max(y + LINE, 0), left : max(x + stencil.width, 0)]
    shares = coverage[top - y :, left - x :][: inside.shape[0], : inside.shape[1], None] / 255
    inside[:] = np.rint(inside * (1 - shares) + np.array(color) * shares)


def width(text: str) -> int:
    """Return the width of a text in pixels."""
    length: float = _font().getlength(_printable(text))
    return math.ceil(length)


def wrap_text(text: str, pixels: int) -> list[str]:
    """Return a text in at most three lines of at most `pixels`, broken after spaces and punctuation if possible.

    A longer one ends with "...".
    wrap_text("Dualwield_Melee_Attack_Chop", 120) → ["Dualwield_Melee_", "Attack_Chop"]
    """
    lines: list[str] = []
    while len(lines) < MAX_LINES - 1:
        most = _count_fitting(text, pixels)
        if most >= len(text):
            break
        cut = max((text[:most].rfind(mark) for mark in " _-./|:"), default=-1) + 1
        cut = cut if cut > most // 3 else most
        lines.append(text[:cut].rstrip())
        text = text[cut:].lstrip()
    return [*lines, _shorten(text, pixels)] if text or not lines else lines


def _shorten(text: str, pixels: int) -> str:
    """Return a text, or as many of its first letters as fit into `pixels` with "..." behind them."""
    if _count_fitting(text, pixels) >= len(text):
        return text
    room = max(pixels - width(ELLIPSIS), 1)
    return text[: _count_fitting(text, room)] + ELLIPSIS


def _count_fitting(text: str, pixels: int) -> int:
    """The number of first letters that fit into `pixels`, at least one of a text that has any.

    Found by halves among so many that the rest of a name of 100 000 letters is never measured.
    """
    most = min(len(text), pixels + 1)  # the narrowest letters are more than a pixel wide
    return max(bisect_right(range(1, most + 1), pixels, key=lambda n: width(text[:n])), min(most, 1))


def header_width(title: str, legend: str) -> int:
    """Return the width in pixels of a title, which is cut where it is long, and a legend."""
    return width(_shorten(title, MAX_TITLE)) + (width(legend) + BAR[0] + SPACE if legend else 0)


def write_header(image: Image, title: str, legend: str, *, left: int, top: int) -> None:
    """Write a title at the top left, and the legend of the heat map at the top right."""
    write(image, _shorten(title, MAX_TITLE), left, top)
    if not legend:
        return
    right = image.shape[1] - left - width(legend)
    write(image, legend, right, top, color=FAINT)
    across, height = BAR
    right -= across + 8
    image[top + 6 : top + 6 + height, right : right + across] = to_srgb(palette.colors(np.linspace(0, 1, across)))
    write(image, "0", right - 8 - width("0"), top, color=FAINT)


def length(meters: float) -> str:
    """Return a length with a suitable unit, in ASCII."""
    for unit, factor in (("m", 1.0), ("cm", 1e2), ("mm", 1e3)):
        if meters * factor >= 1 or unit == "mm":
            return f"{meters * factor:.3g} {unit}"
    raise AssertionError


@cache
def _font() -> FreeTypeFont:
    """Font included in Pillow, the same on every machine. Missing glyphs are boxes."""
    from PIL import ImageFont

    found = ImageFont.load_default(FONT_SIZE)
    assert isinstance(found, ImageFont.FreeTypeFont)
    return found


def _printable(text: str) -> str:
    """Text in one line: unprintable characters (line breaks, lone surrogates) become "?"."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)
