"""What terminals make of bytes, read back by the words of the protocols: no code of `anim` takes part."""

from __future__ import annotations

import base64
import io
import re

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Pixels = NDArray[np.uint8]
XTERM_LEVELS = (0, 95, 135, 175, 215, 255)


def pixels_of(png: bytes) -> Pixels:
    """Return the pixels (H, W, 3) of a PNG."""
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))


def kitty_png(data: bytes) -> bytes:
    """Return the PNG in kitty's escape sequences, after checking each: its keys, and chunks of at most 4096."""
    found = re.fullmatch(rb"((?:\x1b_G[^;]*;[^\x1b]*\x1b\\)+)\n", data)
    assert found
    chunks = re.findall(rb"\x1b_G([^;]*);([^\x1b]*)\x1b\\", found[1])
    for i, (keys, text) in enumerate(chunks):
        said = dict(pair.split(b"=") for pair in keys.split(b","))
        assert said.pop(b"m") == (b"0" if i == len(chunks) - 1 else b"1")
        assert said == ({b"a": b"T", b"f": b"100", b"q": b"2"} if i == 0 else {})
        assert len(text) <= 4096
        assert i == len(chunks) - 1 or len(text) % 4 == 0
    return base64.b64decode(b"".join(text for _, text in chunks), validate=True)


def iterm2_png(data: bytes) -> bytes:
    """Return the PNG in iTerm2's escape sequence."""
    found = re.fullmatch(rb"\x1b\]1337;File=([^:]*):([^\x07]*)\x07\n", data)
    assert found
    said = dict(pair.split(b"=") for pair in found[1].split(b";"))
    png = base64.b64decode(found[2], validate=True)
    assert said == {b"inline": b"1", b"size": str(len(png)).encode()}
    return png


def sixel_pixels(data: bytes) -> Pixels:
    """Return the pixels of sixels (VT340: DECGRA, DECGCI, DECGRI, DECGCR, DECGNL), all of which must be set."""
    found = re.fullmatch(r'\x1bP0;1;0q"1;1;(\d+);(\d+)(.*)\x1b\\\n', data.decode("ascii"))
    assert found
    width, height = int(found[1]), int(found[2])
    picture = np.full((height + 6, width, 3), -1, int)
    colors: dict[int, tuple[int, ...]] = {}
    x = y = color = 0
    for definition, chosen, count, character, control in re.findall(
        r"#(\d+;2;\d+;\d+;\d+)|#(\d+)(?!;)|(?:!(\d+))?([?-~])|([$-])", found[3]
    ):
        if definition:
            number, _, *percent = map(int, definition.split(";"))
            assert max(percent) <= 100
            colors[number] = tuple(round(each * 255 / 100) for each in percent)
        elif chosen:
            color = int(chosen)
        elif character:
            for _ in range(int(count or 1)):
                for row in range(6):
                    if (ord(character) - 63) >> row & 1:
                        picture[y + row, x] = colors[color]
                x += 1
        elif control == "$":
            x = 0
        else:
            x, y = 0, y + 6
    assert (picture[height:] == -1).all(), "nothing below"
    assert (picture[:height] >= 0).all(), "every pixel is set"
    return picture[:height].astype(np.uint8)


def block_pixels(data: bytes) -> Pixels:
    """Return the pixels of half-block characters, two in a cell; a cell without background is (1, 2, 3) below."""
    lines = data.decode().split("\n")
    assert lines.pop() == ""
    rows: list[list[tuple[int, ...]]] = []
    for line in lines:
        assert line.endswith("\x1b[0m")
        upper: tuple[int, ...] = (0, 0, 0)
        lower = upper
        rows += [[], []]
        for codes, _ in re.findall(r"\x1b\[([0-9;]+)m|(▀)", line):
            if codes == "":
                rows[-2].append(upper)
                rows[-1].append(lower)
            for ground, *color in re.findall(r"([34]8);(?:2;(\d+);(\d+);(\d+)|5;(\d+))|(49)", codes):
                if color[-1] == "49":
                    lower = (1, 2, 3)
                    continue
                value: tuple[int, ...] = xterm(int(color[3])) if color[3] else tuple(map(int, color[:3]))
                upper, lower = (value, lower) if ground == "38" else (upper, value)
    return np.array(rows, np.uint8)


def xterm(code: int) -> tuple[int, int, int]:
    """Return xterm's fixed color 16 … 255."""
    if code >= 232:
        return (8 + 10 * (code - 232),) * 3
    code -= 16
    return XTERM_LEVELS[code // 36], XTERM_LEVELS[code // 6 % 6], XTERM_LEVELS[code % 6]
