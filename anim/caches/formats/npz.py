"""VertexCache ↔ .npz: lossless interchange, a zip of numpy arrays, readable by `np.load`.

| array | shape, type | content |
|---|---|---|
| positions | (F, V, 3) float32 | m |
| normals | (F, V, 3) float32 | absent without normals |
| tangents | (F, V, 3) float32 | absent without tangents |
| handedness | (V,) int8 | ±1, of tangents: bitangent = normal × tangent · handedness |
| times | (F,) float64 | s |
| faces | (T, 3) int32 | triangles, counterclockwise |
| rest | (V, 3) float32, or float64 where that is too coarse | m; absent if unknown |
| meta | () unicode, JSON | schema, up, parts: [{name, vertices: [first, end], faces: [first, end], node, material}] |

Only positions, times and faces are required. Members are stored without compression, so that positions are written and
read frame by frame; compressed members (`np.savez_compressed`) are read too.
"""

from __future__ import annotations

import json
import math
import tempfile
import zipfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from typing import IO, Any, BinaryIO

import numpy as np
from numpy.lib import format as npy

from anim.arrays import AnyArray, Floats
from anim.caches import frame_blocks
from anim.caches.options import ReadOptions, WriteOptions, WriteResult
from anim.caches.storage import COPY_BYTES, Inputs, Outputs, size_of
from anim.errors import AnimError, FormatError
from anim.memory import MemoryBudget
from anim.model import FrameChunk, MeshPart, VertexCache

SCHEMA = 1
EXPECTED = {"meta": "text", "faces": "integers"}
DIRECTIONS = ("normals", "tangents")
EPOCH = (1980, 1, 1, 0, 0, 0)  # of every member, for reproducible bytes


def read(inputs: Inputs, reading: ReadOptions) -> VertexCache:
    """Return the cache in the main file; frames are read on iteration, a chunk at a time."""
    with inputs.open(inputs.main) as file, _opened(file) as archive:
        budget = MemoryBudget(size_of(file))
        if {"offsets.npy", "ids.npy"} <= set(archive.namelist()):
            raise FormatError("holds points without faces, of `simulate particles` (expected positions of vertices)")
        shape = _shape(archive, "positions")
        if shape is None:
            raise FormatError("has no array 'positions' (expected positions, times and faces)")
        if not shape[1]:
            raise FormatError("has no vertices")
        present = tuple(name for name in DIRECTIONS if _shape(archive, name) is not None)
        for name in present:
            if _shape(archive, name) != shape:
                raise FormatError(f"{name} have another shape than positions, {shape}")
        wanted = ("times", "faces", "rest", "handedness")
        times, faces, rest, signs = (_array(archive, name, budget) for name in wanted)
        meta = _meta(archive, budget)
    budget.add(shape[1] * 3 * 8 * (1 + len(present)))  # a frame, the least that is read at a time
    if times is None or faces is None:
        raise FormatError(f"has no array '{'times' if times is None else 'faces'}'")
    if times.shape != shape[:1] or faces.shape[1:] != (3,) or (rest is not None and rest.shape != (shape[1], 3)):
        raise FormatError(f"times {times.shape}, faces {faces.shape} and positions {shape} don't fit together")
    if ("tangents" in present) != (signs is not None) or (signs is not None and signs.shape != (shape[1],)):
        raise FormatError("tangents and handedness don't go together (expected both, a sign for each vertex)")
    if faces.size and (faces.min() < 0 or faces.max() >= shape[1]):
        raise FormatError(f"a face uses vertex {faces.max() if faces.min() >= 0 else faces.min()} of {shape[1]}")
    return VertexCache(
        times.astype(np.float64),
        shape[1],
        faces.astype(np.int64),
        lambda: _chunks(inputs, shape, present),
        rest=None if rest is None else rest.astype(np.float64),
        has_normals="normals" in present,
        parts=parts_of(meta),
        up="z" if meta.get("up") == "z" else "y",
        handedness=None if signs is None else signs.astype(np.float64),
    )


def write(cache: VertexCache, outputs: Outputs, writing: WriteOptions) -> WriteResult:
    """Write the cache losslessly into the main file, frame by frame."""
    with (
        outputs.create(outputs.main) as file,
        zipfile.ZipFile(file, "w") as archive,
        ExitStack() as stack,
    ):
        _put(archive, "times", cache.times)
        _put(archive, "faces", cache.faces.astype("<i4"))
        if cache.rest is not None:
            _put(archive, "rest", _rest(cache.rest))
        if cache.handedness is not None:
            _put(archive, "handedness", np.where(cache.handedness < 0, -1, 1).astype("<i1"))
        _put(archive, "meta", np.array(json.dumps(about(cache))))
        shape = (cache.frame_count, cache.vertex_count, 3)
        wanted = [name for name, has in zip(DIRECTIONS, (cache.has_normals, cache.has_tangents), strict=True) if has]
        # Chunks hold these together with positions, but members of a zip are written one after another.
        aside = {name: stack.enter_context(tempfile.TemporaryFile()) for name in wanted}
        with _member(archive, "positions", shape) as member:
            for chunk in cache.chunks():
                member.write(np.ascontiguousarray(chunk.positions, "<f4").data)
                for name, file_aside in aside.items():
                    file_aside.write(np.ascontiguousarray(getattr(chunk, name), "<f4").data)
        for name, file_aside in aside.items():
            file_aside.seek(0)
            with _member(archive, name, shape) as member:
                while piece := file_aside.read(COPY_BYTES):
                    member.write(piece)
    return WriteResult()


def _opened(file: BinaryIO) -> zipfile.ZipFile:
    return _reads(lambda: zipfile.ZipFile(file), "is no .npz")  # type: ignore[no-any-return]


def _reads(job: Callable[[], Any], problem: str = "is damaged") -> Any:
    """Result of a job on a zip; any exception of an invalid zip becomes a FormatError with this problem."""
    try:
        return job()
    except AnimError:
        raise
    except MemoryError:
        raise
    except Exception as error:  # of zip, of its compressions, and of headers, which are Python literals
        raise FormatError(f"{problem} ({' '.join(str(error).lower().split())[:80]})") from None


def _header(member: IO[bytes], name: str) -> tuple[tuple[int, ...], np.dtype[Any]]:
    version = npy.read_magic(member)
    header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, fortran, dtype = header(member)
    if min(shape, default=0) < 0 or any(type(each) is not int for each in shape):
        raise FormatError(f"array '{name}' has shape {shape}")
    if (fortran and len(shape) > 1) or dtype.kind not in "fiuU":
        raise FormatError(f"array '{name}' has an order or type that is not handled ({dtype})")
    return shape, dtype


def _shape(archive: zipfile.ZipFile, name: str) -> tuple[int, ...] | None:
    if f"{name}.npy" not in archive.namelist():
        return None

    def shape() -> tuple[int, ...]:
        with archive.open(f"{name}.npy") as member:
            found, dtype = _header(member, name)
            size = archive.getinfo(f"{name}.npy").file_size - member.tell()
        if len(found) != 3 or found[2] != 3 or dtype.kind == "U":
            raise FormatError(f"array '{name}' has shape {found} of {dtype} (expected (F, V, 3) of numbers)")
        if size != dtype.itemsize * math.prod(found):
            raise FormatError(f"array '{name}' has {size} bytes for shape {found}")
        return found

    return _reads(shape)  # type: ignore[no-any-return]


def _array(archive: zipfile.ZipFile, name: str, budget: MemoryBudget) -> AnyArray | None:
    if f"{name}.npy" not in archive.namelist():
        return None

    def array() -> AnyArray:
        with archive.open(f"{name}.npy") as member:
            shape, dtype = _header(member, name)
            if dtype.kind not in ("U" if name == "meta" else "iu" if name == "faces" else "iuf"):
                raise FormatError(f"array '{name}' holds {dtype} (expected {EXPECTED.get(name, 'numbers')})")
            size, expected = archive.getinfo(f"{name}.npy").file_size - member.tell(), math.prod(shape)
            if size != dtype.itemsize * expected:
                raise FormatError(f"array '{name}' has {size} bytes for shape {shape}")
            budget.add((dtype.itemsize + 8) * expected)  # as stored, and as float64 or int64
            data = member.read()
        if len(data) != size:
            raise FormatError(f"is truncated: array '{name}' ends early")
        found: AnyArray = np.frombuffer(data, dtype).reshape(shape)
        if dtype.kind == "f" and not np.isfinite(found).all():
            raise FormatError(f"array '{name}' holds NaN or infinity")
        return found

    return _reads(array)  # type: ignore[no-any-return]


def _meta(archive: zipfile.ZipFile, budget: MemoryBudget) -> dict[str, Any]:
    text = _array(archive, "meta", budget)
    try:
        meta = json.loads(str(text)) if text is not None else {}
    except (ValueError, RecursionError, SystemError):  # the last of code points beyond Unicode
        raise FormatError("array 'meta' is no JSON") from None
    return meta if isinstance(meta, dict) else {}


def parts_of(meta: dict[str, Any]) -> tuple[MeshPart, ...]:
    """Return the parts in `meta`. Raises FormatError for an invalid list."""
    try:
        return tuple(
            MeshPart(str(p["name"]), _pair(p["vertices"]), _pair(p["faces"]), int(p["node"]), int(p["material"]))
            for p in meta.get("parts", ())
        )
    except (KeyError, TypeError, ValueError, OverflowError):
        raise FormatError("array 'meta' has parts that are not understood") from None


def _pair(values: list[int]) -> tuple[int, int]:
    first, end = values
    return int(first), int(end)


def _chunks(inputs: Inputs, shape: tuple[int, ...], present: Sequence[str]) -> Iterator[FrameChunk]:
    frames, vertices = shape[:2]
    with ExitStack() as stack:
        following = {
            name: _frames(_opened(stack.enter_context(inputs.open(inputs.main))), name, shape)
            for name in ("positions", *present)
        }
        step = frame_blocks.per_chunk(vertices)
        for start in range(0, frames, step):
            count = min(step, frames - start)
            yield FrameChunk(start, **{name: rows(count) for name, rows in following.items()})


def _frames(archive: zipfile.ZipFile, name: str, shape: tuple[int, ...]) -> Callable[[int], AnyArray]:
    """Function that reads the next frames (count, V, 3) of a member."""
    member = archive.open(f"{name}.npy")
    _, dtype = _header(member, name)
    per_frame = shape[1] * 3 * dtype.itemsize

    def following(count: int) -> AnyArray:
        data = _reads(lambda: member.read(count * per_frame))
        if len(data) < count * per_frame:
            raise FormatError(f"is truncated: array '{name}' ends early")
        found = np.frombuffer(data, dtype).reshape(count, shape[1], 3).astype(np.float32, copy=False)
        if not np.isfinite(found).all():
            raise FormatError(f"array '{name}' holds NaN or infinity")
        return found

    return following


def _put(archive: zipfile.ZipFile, name: str, array: AnyArray) -> None:
    with archive.open(_info(name), "w") as member:
        npy.write_array(member, np.ascontiguousarray(array).reshape(array.shape), allow_pickle=False)


def _member(archive: zipfile.ZipFile, name: str, shape: tuple[int, ...]) -> IO[bytes]:
    """A member for float32 of this shape, open for its data after the written header."""
    member = archive.open(_info(name), "w", force_zip64=True)
    npy.write_array_header_1_0(member, {"descr": "<f4", "fortran_order": False, "shape": shape})
    return member


def _info(name: str) -> zipfile.ZipInfo:
    return zipfile.ZipInfo(f"{name}.npy", EPOCH)


def _rest(rest: Floats) -> AnyArray:
    small = rest.astype("<f4")
    return small if np.array_equal(small, rest) else rest


def about(cache: VertexCache) -> dict[str, Any]:
    """Return the `meta` of a cache."""
    parts = [
        {"name": p.name, "vertices": list(p.vertices), "faces": list(p.faces), "node": p.node, "material": p.material}
        for p in cache.parts
    ]
    return {"schema": SCHEMA, "up": cache.up, "parts": parts}
