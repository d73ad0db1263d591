"""The formats of vertex caches, by the ending of their files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from functools import partial
from typing import TypeAlias

from anim.caches import glb, mdd, npz, pc2, sequence, texture, texture_read, usd, usd_read
from anim.caches.files import Inputs, Outputs
from anim.caches.settings import Reading, Writing, Written
from anim.errors import UnsupportedError
from anim.model import VertexCache

Read: TypeAlias = Callable[[Inputs, Reading], VertexCache]
Write: TypeAlias = Callable[[VertexCache, Outputs, Writing], Written]


class Files(Enum):
    """Which files hold a cache: one is enough, one for each frame, or several that say nothing without each other."""

    ONE = "one"
    FRAMES = "frames"
    SEVERAL = "several"


@dataclass(frozen=True, slots=True)
class CacheFormat:
    """One format. about: for --help. takes: the fields of Reading and Writing that mean something to it.

    holds: "normals" and "tangents", where there is a place for them beside positions. files: which ones a cache is.
    """

    about: str
    read: Read
    write: Write
    takes: frozenset[str] = frozenset()
    holds: frozenset[str] = frozenset()
    files: Files = Files.ONE


NORMALS = frozenset(("normals",))
BOTH = frozenset(("normals", "tangents"))
RATE = frozenset(("read_fps",))

CACHE_FORMATS: dict[str, CacheFormat] = {
    ".npz": CacheFormat("numpy arrays, lossless: the hub", npz.read, npz.write, holds=BOTH),
    ".pc2": CacheFormat("point cache of 3ds Max and Blender", pc2.read, pc2.write, frozenset(("read_fps", "rest"))),
    ".mdd": CacheFormat("point cache of LightWave and Blender", mdd.read, mdd.write, frozenset(("rest",))),
    ".usdc": CacheFormat("USD, binary (extra usd)", usd_read.read, partial(usd.write, ending=".usdc"), RATE, BOTH),
    ".usda": CacheFormat("USD, text (extra usd)", usd_read.read, partial(usd.write, ending=".usda"), RATE, BOTH),
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
        partial(texture.write, ending=".exr"),
        frozenset(("preset", "depth")),
        NORMALS,
        Files.SEVERAL,
    ),
    ".png": CacheFormat(
        "vertex animation texture, 16 bit",
        texture_read.read,
        partial(texture.write, ending=".png"),
        frozenset(("preset",)),
        NORMALS,
        Files.SEVERAL,
    ),
    ".ply": CacheFormat(
        "a mesh a frame",
        partial(sequence.read, ending=".ply"),
        partial(sequence.write, ending=".ply"),
        RATE,
        NORMALS,
        Files.FRAMES,
    ),
    ".obj": CacheFormat(
        "a mesh a frame, as text",
        partial(sequence.read, ending=".obj"),
        partial(sequence.write, ending=".obj"),
        RATE,
        NORMALS,
        Files.FRAMES,
    ),
    ".stl": CacheFormat(
        "a mesh a frame, without order",
        partial(sequence.read, ending=".stl"),
        partial(sequence.write, ending=".stl"),
        RATE,
        files=Files.FRAMES,
    ),
}


def reader_for(ending: str) -> Read:
    """Return what reads files of this ending (".npz"): reader_for(".pc2")(inputs, Reading()) → VertexCache.

    What it reads has this format, whatever the name. Raises UnsupportedError for an ending that no cache has.
    """
    return _of(ending).read


def writer_for(ending: str) -> Write:
    """Return what writes this format, whatever the name: writer_for(".npz")(cache, outputs, Writing()) → Written."""
    return _of(ending).write


def _of(ending: str) -> CacheFormat:
    found = CACHE_FORMATS.get(ending.lower())
    if found is None:
        raise UnsupportedError(f"no cache format is called '{ending}' (expected {', '.join(CACHE_FORMATS)})")
    return found
