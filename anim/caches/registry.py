"""The formats of vertex caches, by the ending of their files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from functools import partial
from typing import TypeAlias

from anim.caches.formats import gltf, mdd, mesh_sequence, npz, pc2, usd_reader, usd_writer
from anim.caches.options import ReadOptions, WriteOptions, WriteResult
from anim.caches.storage import Inputs, Outputs
from anim.caches.vat import reader, writer
from anim.errors import UnsupportedError
from anim.model import VertexCache

Read: TypeAlias = Callable[[Inputs, ReadOptions], VertexCache]
Write: TypeAlias = Callable[[VertexCache, Outputs, WriteOptions], WriteResult]


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


def _frames(ending: str, about: str, *, holds: frozenset[str] = NORMALS) -> CacheFormat:
    read, write = partial(mesh_sequence.read, ending=ending), partial(mesh_sequence.write, ending=ending)
    return CacheFormat(about, read, write, RATE, holds, Files.FRAMES)


def _usd(ending: str, about: str) -> CacheFormat:
    return CacheFormat(about, usd_reader.read, partial(usd_writer.write, ending=ending), RATE, BOTH)


def _texture(ending: str, about: str, *takes: str) -> CacheFormat:
    write = partial(writer.write, ending=ending)
    return CacheFormat(about, reader.read, write, frozenset(takes), NORMALS, Files.SEVERAL)


CACHE_FORMATS: dict[str, CacheFormat] = {
    ".npz": CacheFormat("numpy arrays, lossless: the hub", npz.read, npz.write, holds=BOTH),
    ".pc2": CacheFormat("point cache of 3ds Max and Blender", pc2.read, pc2.write, frozenset(("read_fps", "rest"))),
    ".mdd": CacheFormat("point cache of LightWave and Blender", mdd.read, mdd.write, frozenset(("rest",))),
    ".usdc": _usd(".usdc", "USD, binary (extra usd)"),
    ".usda": _usd(".usda", "USD, text (extra usd)"),
    ".glb": CacheFormat(
        "glTF: morph targets or a flip-book",
        gltf.read,
        gltf.write,
        frozenset(("read_fps", "max_error", "quantize", "layout")),
        BOTH,
    ),
    ".exr": _texture(".exr", "vertex animation texture, float (extra exr)", "preset", "depth"),
    ".png": _texture(".png", "vertex animation texture, 16 bit", "preset"),
    ".ply": _frames(".ply", "a mesh a frame"),
    ".obj": _frames(".obj", "a mesh a frame, as text"),
    ".stl": _frames(".stl", "a mesh a frame, without order", holds=frozenset()),
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
