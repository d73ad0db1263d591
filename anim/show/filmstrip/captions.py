"""Words on pictures made of pixels: titles, names of rows, times, and the legend of colors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from anim.show.filmstrip import glyphs, heat_map
from anim.show.filmstrip.renderer import encoded

INK, FAINT = (56, 58, 62), (120, 123, 128)  # sRGB
LETTER = 2  # pixels of a dot of the font
BAR = 120, 8  # pixels of the heat's legend
SPACE = 40  # pixels between title and legend
LINE = glyphs.HEIGHT * LETTER + 3  # pixels from one line of words to the next

Image = NDArray[np.uint8]


def write(image: Image, text: str, x: int, y: int, *, color: tuple[int, int, int] = INK) -> None:
    """Write a text with its top left at x, y pixels."""
    glyphs.write(image, text, x, y, size=LETTER, color=color)


def width(text: str) -> int:
    """Return how many pixels a text takes across."""
    return glyphs.width(text, size=LETTER)


def wrapped(text: str, pixels: int) -> list[str]:
    """Return a text in lines of at most `pixels` across, broken behind spaces and marks where there are any near.

    wrapped("Dualwield_Melee_Attack_Chop", 200) → ["Dualwield_Melee_", "Attack_Chop"]
    """
    most = max((pixels + LETTER) // (glyphs.STEP * LETTER), 1)
    lines = []
    while len(text) > most:
        cut = max((text[:most].rfind(mark) for mark in " _-./|:"), default=-1) + 1
        cut = cut if cut > most // 3 else most
        lines.append(text[:cut].rstrip())
        text = text[cut:].lstrip()
    return [*lines, text] if text or not lines else lines


def header_width(title: str, legend: str) -> int:
    """Return how many pixels a title takes with a legend beside it."""
    return width(title) + (width(legend) + BAR[0] + SPACE if legend else 0)


def write_header(image: Image, title: str, legend: str, *, left: int, top: int) -> None:
    """Write a title at the top left, and at the top right what the far end of the heat's colors means."""
    write(image, title, left, top)
    if not legend:
        return
    right = image.shape[1] - left - width(legend)
    write(image, legend, right, top, color=FAINT)
    across, height = BAR
    right -= across + 8
    image[top + 3 : top + 3 + height, right : right + across] = encoded(heat_map.colors(np.linspace(0, 1, across)))
    write(image, "0", right - 8 - width("0"), top, color=FAINT)


def length(meters: float) -> str:
    """Return a length in a unit that suits it, in ASCII."""
    for unit, factor in (("m", 1.0), ("cm", 1e2), ("mm", 1e3)):
        if meters * factor >= 1 or unit == "mm":
            return f"{meters * factor:.3g} {unit}"
    raise AssertionError
