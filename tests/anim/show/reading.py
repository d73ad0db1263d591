"""What a picture's bytes say: its kind, its size, and the words in it."""

from __future__ import annotations

import struct
from xml.etree import ElementTree

SVG = "{http://www.w3.org/2000/svg}"


def words(svg: bytes) -> list[str]:
    """Return all texts of an SVG, which must be well-formed."""
    root = ElementTree.fromstring(svg)
    assert root.tag == f"{SVG}svg"
    return ["".join(text.itertext()) for text in root.iter(f"{SVG}text")]


def png_size(data: bytes) -> tuple[int, int]:
    """Return width and height of a PNG in pixels."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    assert data[-8:-4] == b"IEND"
    width, height = struct.unpack(">II", data[16:24])
    return width, height
