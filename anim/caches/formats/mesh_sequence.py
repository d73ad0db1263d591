"""VertexCache ↔ one numbered file per frame: walk_00001.ply, …; a single frame is walk.ply itself."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import PurePath

import numpy as np

from anim.arrays import Floats, Ints
from anim.caches import frame_blocks
from anim.caches.formats import mesh_frame
from anim.caches.formats.mesh_materials import mesh_materials, write_library
from anim.caches.options import ReadOptions, WriteOptions, WriteResult
from anim.caches.storage import Inputs, Outputs, companion_name, open_bytes
from anim.caches.transforms import statistics
from anim.errors import FormatError
from anim.model import FrameChunk, VertexCache

DEFAULT_FPS = 24.0  # for files of other programs, which have no rate
COMMENT_BYTES = 1024  # bytes that contain the comment


def read(inputs: Inputs, reading: ReadOptions, *, ending: str) -> VertexCache:
    """Return the frames of one sequence: of walk.ply if it exists, else of all walk_*.ply in order.

    All have the format of `ending`, whatever their names.
    Remaining frames of an older, longer sequence of this library are ignored: the first file states the frame count.
    Raises FormatError for a missing frame, as after an interrupted write.
    Times are those stored in this library's files, else frames at `reading.input_fps` or 24 per second. The first frame
    gives the faces; every other must have as many vertices.
    """
    names = sequence_members(inputs)
    with open_bytes(inputs, names[0]) as data:
        first = mesh_frame.read(data, ending)
    names = _of_one_sequence(inputs.main, names, first.remark.get("frames", ""))
    return VertexCache(
        _times(inputs, names, reading.input_fps),
        len(first.positions),
        first.faces,
        lambda: _chunks(inputs, names, first, ending),
        has_normals=first.normals is not None,
        up=first.remark.get("up", "y"),
    )


def write(cache: VertexCache, outputs: Outputs, writing: WriteOptions, *, ending: str) -> WriteResult:
    """Write a file of the format `ending` per frame, numbered from 1; the main file for a single frame."""
    faces: Ints = cache.faces
    materials = None
    if writing.source is not None:
        library = companion_name(outputs.main, ".mtl") if ending == ".obj" else ""
        materials = mesh_materials(cache, writing.source.document, library)
        if library:
            write_library(writing.source.document, outputs, library)
    for chunk in cache.chunks():
        for i, positions in enumerate(chunk.positions):
            frame = chunk.first + i
            normals = chunk.normals[i] if chunk.normals is not None and ending != ".stl" else None
            remark = {"time": f"{cache.times[frame]:.9g}", "up": cache.up, "frames": str(cache.frame_count)}
            name = outputs.main if cache.frame_count == 1 else frame_number(outputs.main, frame + 1)
            with outputs.create(name) as file:
                mesh = mesh_frame.MeshFrame(positions, faces, normals, remark, materials)
                file.write(mesh_frame.write(mesh, ending))
    notes = ("STL keeps no order of vertices: each triangle has three of its own",) if ending == ".stl" else ()
    return WriteResult(notes=(*notes, *statistics.notes(cache.times)))


def frame_number(name: str, number: int) -> str:
    """Return the name of a frame's file: frame_number("walk.ply", 7) → "walk_00007.ply"."""
    return f"{_stem(name)}_{number:05d}{PurePath(name).suffix}"


def sequence_files(main: str, names: Iterable[str]) -> Sequence[str]:
    """Return the numbered frames of `main` among the names, in order."""
    pattern = re.compile(re.escape(_stem(main)) + r"_(\d+)" + re.escape(PurePath(main).suffix))
    found = sorted((int(match[1]), name) for name in names if (match := pattern.fullmatch(name)))
    return [name for _, name in found]


def sequence_members(inputs: Inputs) -> Sequence[str]:
    """Return the files to read: the main one, or its frames. Raises FormatError without any."""
    names = inputs.names()
    is_numbered = re.search(r"_\d+$", PurePath(inputs.main).stem) is not None
    if inputs.main in names and not is_numbered:
        return [inputs.main]
    found = sequence_files(inputs.main, names)
    if not found:
        raise FormatError(f"is not there, nor is {frame_number(inputs.main, 1)}")
    return found


def _of_one_sequence(main: str, names: Sequence[str], count: str) -> Sequence[str]:
    """Frames of the first file's sequence (`count` of them); all, for other programs' (count is "")."""
    if not count.isdecimal() or not int(count):
        return names
    if int(count) == 1:
        return names[:1]
    there = set(names)
    wanted = [frame_number(main, number) for number in range(1, min(int(count), len(names) + 1) + 1)]
    if missing := next((name for name in wanted if name not in there), None):
        raise FormatError(f"'{missing}' is not there (the sequence has {count} frames)", help="write all of it again")
    return wanted


def _stem(name: str) -> str:
    return re.sub(r"_\d+$", "", PurePath(name).stem)


def _times(inputs: Inputs, names: Sequence[str], fps: float | None) -> Floats:
    said = []
    for name in names:
        with inputs.open(name) as file:
            said.append(mesh_frame.comment_of(file.read(COMMENT_BYTES)).get("time"))
    if fps is None and None not in said:
        try:
            times = np.array(said, np.float64)
        except ValueError:
            times = np.zeros(len(names))
        if np.isfinite(times).all() and times[0] >= 0 and (np.diff(times) > 0).all():
            return times
    return np.arange(len(names)) / (fps or DEFAULT_FPS)


def _chunks(inputs: Inputs, names: Sequence[str], start: mesh_frame.MeshFrame, ending: str) -> Iterator[FrameChunk]:
    vertices, has_normals = len(start.positions), start.normals is not None
    step = frame_blocks.per_chunk(vertices)
    for first in range(0, len(names), step):
        stills = []
        for name in names[first : first + step]:
            with open_bytes(inputs, name) as data:
                frame = mesh_frame.read(data, ending)
            if len(frame.positions) != vertices:
                raise FormatError(f"'{name}' has {len(frame.positions)} vertices (the first has {vertices})")
            if has_normals and frame.normals is None:
                raise FormatError(f"'{name}' has no normals (the first has)")
            stills.append(frame)
        normals = np.stack([f.normals for f in stills if f.normals is not None]) if has_normals else None
        yield FrameChunk(first, np.stack([frame.positions for frame in stills]), normals)
