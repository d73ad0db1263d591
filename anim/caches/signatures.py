"""The first bytes of cache formats, as tests on them and on the size of the file."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import TypeAlias

Signature: TypeAlias = Callable[[bytes, int], bool]  # the first bytes of a file, its size in bytes

OBJ_WORDS = frozenset((b"v", b"vn", b"vt", b"vp", b"f", b"l", b"p", b"o", b"g", b"s", b"mtllib", b"usemtl"))


def starts_with(magic: bytes) -> Signature:
    """Return the signature of a format whose files start with these bytes."""
    return lambda head, _: head.startswith(magic)


def is_usdz(head: bytes, size: int) -> bool:
    """Return whether a file is an archive whose first file is a USD stage."""
    name = head[30 : 30 + int.from_bytes(head[26:28], "little")]
    return head.startswith(b"PK") and name.endswith((b".usd", b".usda", b".usdc"))


def is_gltf(head: bytes, size: int) -> bool:
    """Return whether a file is glTF as text: JSON with a version in its first bytes."""
    return head.lstrip().startswith(b"{") and b'"asset"' in head and b'"version"' in head


def is_npz(head: bytes, size: int) -> bool:
    """Return whether a file is any other archive."""
    return head.startswith(b"PK") and not is_usdz(head, size)


def is_mdd(head: bytes, size: int) -> bool:
    """Return whether a file is MDD: it has no magic bytes, but its size follows from its header."""
    if len(head) < 8:
        return False
    frames, points = struct.unpack(">ii", head[:8])
    return bool(frames > 0 and points > 0 and size == 8 + 4 * frames + 12 * frames * points)


def is_stl(head: bytes, size: int) -> bool:
    """Return whether a file is STL.

    Binary: a comment of 80 bytes, the number of triangles, 50 bytes each. Text: "solid" and a name.
    """
    if len(head) >= 84 and size == 84 + 50 * int.from_bytes(head[80:84], "little"):
        return True
    return head.startswith(b"solid") and b"facet" in head


def is_obj(head: bytes, size: int) -> bool:
    """Return whether a file is text in which every line starts with a keyword of OBJ, or is a comment."""
    lines = head.splitlines() if len(head) == size else head.splitlines()[:-1]
    words = [line.split(maxsplit=1)[0] for line in lines if line.strip()]
    keywords = [word for word in words if not word.startswith(b"#")]
    return b"\0" not in head and bool(words) and all(word in OBJ_WORDS for word in keywords)
