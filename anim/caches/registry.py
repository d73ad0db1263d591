"""The formats of vertex caches, by file extension or by their first bytes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial
from typing import TypeAlias

import numpy as np

from anim.caches.formats import alembic, gltf, mdd, mesh_sequence, npz, pc2, usd_reader, usd_writer
from anim.caches.options import ReadOptions, WriteOptions, WriteResult
from anim.caches.signatures import Signature, is_gltf, is_mdd, is_npz, is_obj, is_stl, is_usdz, starts_with
from anim.caches.storage import Inputs, Outputs
from anim.caches.vat import reader, writer
from anim.errors import AnimError, FormatError, RangeError, ShapeError, UnsupportedError
from anim.model import FrameChunk, VertexCache
from anim.model.vertex_cache import Chunks

Read: TypeAlias = Callable[[Inputs, ReadOptions], VertexCache]
Write: TypeAlias = Callable[[VertexCache, Outputs, WriteOptions], WriteResult]
MAX_FLOAT32 = float(np.finfo(np.float32).max)
SIGNATURE_BYTES = 1024  # bytes that are enough for every signature


class Files(Enum):
    """Files of a cache: a single one, one per frame, or several that are valid only together."""

    ONE = "one"
    FRAMES = "frames"
    SEVERAL = "several"


@dataclass(frozen=True, slots=True)
class CacheFormat:
    """One format. about: for --help. read: None if it is only written. begins: signature of its files, for input
    without a name.

    takes: names of the fields of ReadOptions ("input_fps") and WriteOptions that it supports. holds: "normals",
    "tangents", if it stores them beside positions. files: the files of one cache. check_frames: raises UnsupportedError
    for more frames of so many vertices than it can write, before any is computed; None if they are streamed.
    up: the axis that is up in all its files, for players; "" for one that has either.
    """

    about: str
    read: Read | None
    write: Write
    begins: Signature
    takes: frozenset[str] = frozenset()
    holds: frozenset[str] = frozenset()
    files: Files = Files.ONE
    check_frames: Callable[[int, int, WriteOptions], None] | None = None
    up: str = ""


NORMALS = frozenset(("normals",))
BOTH = frozenset(("normals", "tangents"))
RATE = frozenset(("input_fps",))
GLTF_OPTIONS = frozenset(("input_fps", "max_error", "quantize", "layout", "max_targets", "source"))


def _frames(ending: str, about: str, begins: Signature, *, holds: frozenset[str] = NORMALS) -> CacheFormat:
    read, write = partial(mesh_sequence.read, ending=ending), partial(mesh_sequence.write, ending=ending)
    takes = RATE | {"source"} if ending != ".stl" else RATE
    return CacheFormat(about, read, write, begins, takes, holds, Files.FRAMES)


def _usd(ending: str, about: str, begins: Signature) -> CacheFormat:
    read = partial(usd_reader.read, ending=".usdz" if ending == ".usdz" else ".usd")
    return CacheFormat(about, read, partial(usd_writer.write, ending=ending), begins, RATE | {"source"}, BOTH)


def _texture(ending: str, about: str, magic: bytes, *takes: str) -> CacheFormat:
    write = partial(writer.write, ending=ending)
    return CacheFormat(
        about, reader.read, write, starts_with(magic), frozenset((*takes, "source")), NORMALS, Files.SEVERAL
    )


CACHE_FORMATS: dict[str, CacheFormat] = {
    ".npz": CacheFormat("numpy arrays, lossless: the hub", npz.read, npz.write, is_npz, holds=BOTH),
    ".pc2": CacheFormat(
        "point cache of 3ds Max and Blender",
        pc2.read,
        pc2.write,
        starts_with(b"POINTCACHE2"),
        frozenset(("input_fps", "rest_mesh")),
    ),
    ".mdd": CacheFormat("point cache of LightWave and Blender", mdd.read, mdd.write, is_mdd, frozenset(("rest_mesh",))),
    ".usdc": _usd(".usdc", "USD, binary (extra usd)", starts_with(b"PXR-USDC")),
    ".usda": _usd(".usda", "USD, text (extra usd)", starts_with(b"#usda")),
    ".usdz": _usd(".usdz", "USD with its images, a package (extra usd)", is_usdz),
    ".abc": CacheFormat(
        "Alembic, written only (extra alembic)",
        None,
        alembic.write,
        starts_with(b"Ogawa"),
        frozenset(("source",)),
        NORMALS,
        up="y",
    ),
    ".glb": CacheFormat(
        "glTF: morph targets or a flip-book",
        gltf.read,
        gltf.write,
        starts_with(b"glTF"),
        GLTF_OPTIONS,
        BOTH,
        check_frames=gltf.check_frames,
        up="y",
    ),
    ".gltf": CacheFormat(
        "glTF as text, with a .bin",
        gltf.read,
        gltf.write_with_buffers,
        is_gltf,
        GLTF_OPTIONS,
        BOTH,
        Files.SEVERAL,
        gltf.check_frames,
        "y",
    ),
    ".exr": _texture(".exr", "vertex animation texture, float (extra exr)", b"\x76\x2f\x31\x01", "preset", "depth"),
    ".png": _texture(".png", "vertex animation texture, 16 bit", b"\x89PNG\r\n\x1a\n", "preset"),
    ".ply": _frames(".ply", "a mesh a frame", starts_with(b"ply")),
    ".obj": _frames(".obj", "a mesh a frame, as text", is_obj),
    ".stl": _frames(".stl", "a mesh a frame, without order", is_stl, holds=frozenset()),
}


READABLE = tuple(ending for ending, each in CACHE_FORMATS.items() if each.read is not None)


def reader_for(ending: str) -> Read:
    """Return the reader of a format: reader_for(".pc2")(inputs, ReadOptions()) → VertexCache.

    It reads this format from files of any name; invalid contents raise FormatError, in chunks too. Raises
    UnsupportedError for an unknown file extension, or a format that is only written.
    """
    read = _of(ending).read
    if read is None:
        raise UnsupportedError(f"{ending[1:]} is only written, not read", help="USD, PC2 and MDD are read")
    return partial(_read, read)


def check_frames(ending: str, frames: int, vertices: int, writing: WriteOptions) -> None:
    """Raise UnsupportedError for more frames of so many vertices than a format can write."""
    if (check := _of(ending).check_frames) is not None:
        check(frames, vertices, writing)


def writer_for(ending: str) -> Write:
    """Return the writer of a format: writer_for(".npz")(cache, outputs, WriteOptions()) → WriteResult."""
    return partial(_write, _of(ending).write)


def _read(read: Read, inputs: Inputs, reading: ReadOptions) -> VertexCache:
    # The caller's frame rate may be too high
    with _format_errors(ShapeError if reading.input_fps else (ShapeError, RangeError)):
        cache = read(inputs, reading)
    return replace(cache, chunks=partial(_chunks, cache.chunks))


def _chunks(chunks: Chunks) -> Iterator[FrameChunk]:
    with _format_errors((ShapeError, RangeError)):
        for chunk in chunks():
            yield chunk.check_finite()


def _write(write: Write, cache: VertexCache, outputs: Outputs, writing: WriteOptions) -> WriteResult:
    """Write a cache of finite numbers. Raises FormatError for others, which come from the input's transforms."""
    if not cache.times[-1] <= MAX_FLOAT32:
        raise FormatError(f"the last frame is at {cache.times[-1]:g} s, beyond float32")
    if cache.rest is not None and not (within := (np.abs(cache.rest) <= MAX_FLOAT32).all(axis=1)).all():
        vertex = int(np.argmin(within))
        raise FormatError(
            f"vertex {vertex} is beyond float32 (got {cache.rest[vertex].tolist()})", where="the rest mesh"
        )
    checked = replace(cache, chunks=lambda: (chunk.check_finite() for chunk in cache.chunks()))
    return write(checked, outputs, writing)


@contextmanager
def _format_errors(kinds: type[AnimError] | tuple[type[AnimError], ...]) -> Iterator[None]:
    """Convert errors of arrays into FormatError: their values are those of the file."""
    try:
        yield
    except kinds as error:
        raise FormatError(error.problem, where=error.where, help=error.help) from None


def _of(ending: str) -> CacheFormat:
    found = CACHE_FORMATS.get(ending.lower())
    if found is None:
        raise UnsupportedError(
            f"unsupported cache format '{ending}' (expected {', '.join(CACHE_FORMATS)})",
            help="gltf-anim from-euler makes glTF of BVH" if ending.lower() == ".bvh" else "",
        )
    return found


def sniff_format(head: bytes, size: int) -> str:
    """Return a format's file extension by a file's size and first bytes (`SIGNATURE_BYTES` if possible).

    Raises FormatError for bytes that no cache format starts with.
    """
    for ending, each in CACHE_FORMATS.items():
        if each.begins(head, size):
            return ending
    raise FormatError(f"starts with {head[:12]!r}, as no cache format does" if head else "is empty")
