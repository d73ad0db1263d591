"""The format of a file without a name, by its first bytes and its size."""

from __future__ import annotations

import struct
from collections.abc import Callable

from anim.errors import FormatError

HEAD = 1024  # bytes that are enough to tell any format
OBJ_WORDS = frozenset((b"v", b"vn", b"vt", b"vp", b"f", b"l", b"p", b"o", b"g", b"s", b"mtllib", b"usemtl"))


def sniff_format(head: bytes, size: int) -> str:
    """Return the ending of the format of a file, by its first bytes, best `HEAD` of them, and its size in bytes.

    Raises FormatError for bytes with which no cache begins.
    """
    for ending, begins in SIGNATURES:
        if begins(head, size):
            return ending
    raise FormatError(f"starts with {head[:12]!r}, as no cache format does" if head else "is empty")


def _is_mdd(head: bytes, size: int) -> bool:
    if len(head) < 8:
        return False
    frames, points = struct.unpack(">ii", head[:8])
    return bool(frames > 0 and points > 0 and size == 8 + 4 * frames + 12 * frames * points)


def _is_stl(head: bytes, size: int) -> bool:
    """Binary: a comment of 80 bytes, the number of triangles, 50 bytes each. Text: "solid" and a name."""
    if len(head) >= 84 and size == 84 + 50 * int.from_bytes(head[80:84], "little"):
        return True
    return head.startswith(b"solid") and b"facet" in head


def _is_obj(head: bytes, size: int) -> bool:
    """Text of which every line begins with a word of OBJ, or is a comment."""
    lines = head.splitlines() if len(head) == size else head.splitlines()[:-1]
    words = [line.split(maxsplit=1)[0] for line in lines if line.strip()]
    said = [word for word in words if not word.startswith(b"#")]
    return b"\0" not in head and bool(words) and all(word in OBJ_WORDS for word in said)


# Asked in this order. MDD and binary STL have no magic, but their sizes give them away.
SIGNATURES: tuple[tuple[str, Callable[[bytes, int], bool]], ...] = (
    (".npz", lambda head, _: head.startswith(b"PK")),
    (".pc2", lambda head, _: head.startswith(b"POINTCACHE2")),
    (".usdc", lambda head, _: head.startswith(b"PXR-USDC")),
    (".usda", lambda head, _: head.startswith(b"#usda")),
    (".glb", lambda head, _: head.startswith(b"glTF")),
    (".exr", lambda head, _: head.startswith(b"\x76\x2f\x31\x01")),
    (".png", lambda head, _: head.startswith(b"\x89PNG\r\n\x1a\n")),
    (".ply", lambda head, _: head.startswith(b"ply")),
    (".mdd", _is_mdd),
    (".stl", _is_stl),
    (".obj", _is_obj),
)
