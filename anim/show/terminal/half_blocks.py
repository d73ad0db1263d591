"""Pixels as half-block characters: two in each cell, the upper as text color, the lower as background."""

from __future__ import annotations

import numpy as np

from anim.arrays import AnyArray, Ints

UPPER_HALF = "▀"
CUBE_LEVELS = np.array((0, 95, 135, 175, 215, 255))  # of red, green and blue in xterm's colors 16 … 231
FIRST_CUBE, FIRST_GRAY, NUM_GRAYS = 16, 232, 24  # grays of xterm: 8, 18, … 238


def encode_half_blocks(image: AnyArray, *, is_true_color: bool = True) -> bytes:
    """Return lines of half-block characters for a picture (H, W, 3) of 8 bits per channel, one cell per column.

    is_true_color: 24 bits per color; else the nearest of xterm's 256 colors. A last odd row has no background.
    """
    rows = [_codes(image, "38", is_true_color), _codes(image, "48", is_true_color)]
    lines = []
    for top in range(0, len(image), 2):
        upper, lower = rows[0][top], rows[1][top + 1] if top + 1 < len(image) else ["49"] * image.shape[1]
        before = ("", "")
        cells = []
        for pair in zip(upper, lower, strict=True):
            changed = [new for new, old in zip(pair, before, strict=True) if new != old]
            cells.append(f"\x1b[{';'.join(changed)}m{UPPER_HALF}" if changed else UPPER_HALF)
            before = pair
        lines.append(f"{''.join(cells)}\x1b[0m\n")
    return "".join(lines).encode()


def _codes(image: AnyArray, ground: str, is_true_color: bool) -> list[list[str]]:
    """Parameters of the escape sequences that set a color, for every pixel."""
    if is_true_color:
        return [[f"{ground};2;{r};{g};{b}" for r, g, b in row] for row in image.tolist()]
    return [[f"{ground};5;{code}" for code in row] for row in nearest_of_256(image).tolist()]


def nearest_of_256(image: AnyArray) -> Ints:
    """Return the nearest of xterm's 240 fixed colors, 16 … 255, for every pixel (H, W, 3)."""
    pixels = image.astype(np.int64)
    steps = np.abs(pixels[..., None] - CUBE_LEVELS).argmin(axis=-1)
    cube = FIRST_CUBE + steps @ np.array((36, 6, 1))
    level = np.clip(np.rint((pixels.mean(axis=-1) - 8) / 10), 0, NUM_GRAYS - 1).astype(np.int64)
    gray = np.broadcast_to((8 + 10 * level)[..., None], pixels.shape)
    is_gray = ((pixels - gray) ** 2).sum(axis=-1) < ((pixels - CUBE_LEVELS[steps]) ** 2).sum(axis=-1)
    codes: Ints = np.where(is_gray, FIRST_GRAY + level, cube)
    return codes
