"""The formats of vertex caches, by the ending of their files."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from anim.caches import glb, mdd, npz, pc2, sequence, texture, texture_read, usd, usd_read
from anim.caches.files import Inputs, Outputs
from anim.caches.settings import Reading, Writing, Written
from anim.errors import FormatError, UnsupportedError
from anim.model import VertexCache

Read: TypeAlias = Callable[[Inputs, Reading], VertexCache]
Write: TypeAlias = Callable[[VertexCache, Outputs, Writing], Written]


@dataclass(frozen=True, slots=True)
class CacheFormat:
    """One format. about: for --help. takes: the fields of Reading and Writing that mean something to it.

    holds: "normals" and "tangents", where there is a place for them beside positions.
    """

    about: str
    read: Read
    write: Write
    takes: frozenset[str] = frozenset()
    holds: frozenset[str] = frozenset()


NORMALS = frozenset(("normals",))
BOTH = frozenset(("normals", "tangents"))

CACHE_FORMATS: dict[str, CacheFormat] = {
    ".npz": CacheFormat("numpy arrays, lossless: the hub", npz.read, npz.write, holds=BOTH),
    ".pc2": CacheFormat("point cache of 3ds Max and Blender", pc2.read, pc2.write, frozenset(("read_fps", "rest"))),
    ".mdd": CacheFormat("point cache of LightWave and Blender", mdd.read, mdd.write, frozenset(("rest",))),
    ".usdc": CacheFormat("USD, binary (extra usd)", usd_read.read, usd.write, frozenset(("read_fps",)), BOTH),
    ".usda": CacheFormat("USD, text (extra usd)", usd_read.read, usd.write, frozenset(("read_fps",)), BOTH),
    ".glb": CacheFormat(
        "glTF: morph targets or a flip-book",
        glb.read,
        glb.write,
        frozenset(("read_fps", "max_error", "quantize", "layout")),
        BOTH,
    ),
    ".exr": CacheFormat(
        "vertex animation texture, float (extra exr)",
        texture_read.read,
        texture.write,
        frozenset(("preset", "depth")),
        NORMALS,
    ),
    ".png": CacheFormat(
        "vertex animation texture, 16 bit", texture_read.read, texture.write, frozenset(("preset",)), NORMALS
    ),
    ".ply": CacheFormat("a mesh a frame", sequence.read, sequence.write, frozenset(("read_fps",)), NORMALS),
    ".obj": CacheFormat("a mesh a frame, as text", sequence.read, sequence.write, frozenset(("read_fps",)), NORMALS),
    ".stl": CacheFormat("a mesh a frame, without order", sequence.read, sequence.write, frozenset(("read_fps",))),
}


def reader_for(ending: str) -> Read:
    """Return what reads files of this ending (".npz"): reader_for(".pc2")(inputs, Reading()) → VertexCache.

    Raises UnsupportedError for an ending that no cache has.
    """
    return _of(ending).read


def writer_for(ending: str) -> Write:
    """Return what writes files of this ending: writer_for(".npz")(cache, outputs, Writing()) → Written."""
    return _of(ending).write


def ending_of(head: bytes, size: int) -> str:
    """Return the ending of the format of a file without a name, by its first bytes and its size.

    Raises FormatError for bytes with which no cache begins.
    """
    for ending, begins in BEGINNINGS:
        if begins(head, size):
            return ending
    raise FormatError(f"starts with {head[:12]!r}, as no cache format does" if head else "is empty")


def _mdd_fits(head: bytes, size: int) -> bool:
    if len(head) < 8:
        return False
    frames, points = struct.unpack(">ii", head[:8])
    return bool(frames > 0 and points > 0 and size == 8 + 4 * frames + 12 * frames * points)


# What the first bytes of files without a name are, asked in this order; MDD has no magic, but its size gives it away.
BEGINNINGS: tuple[tuple[str, Callable[[bytes, int], bool]], ...] = (
    (".npz", lambda head, _: head.startswith(b"PK")),
    (".pc2", lambda head, _: head.startswith(b"POINTCACHE2")),
    (".usdc", lambda head, _: head.startswith(b"PXR-USDC")),
    (".usda", lambda head, _: head.startswith(b"#usda")),
    (".glb", lambda head, _: head.startswith(b"glTF")),
    (".ply", lambda head, _: head.startswith(b"ply")),
    (".mdd", _mdd_fits),
)


def _of(ending: str) -> CacheFormat:
    found = CACHE_FORMATS.get(ending.lower())
    if found is None:
        raise UnsupportedError(f"no cache format is called '{ending}' (expected {', '.join(CACHE_FORMATS)})")
    return found
