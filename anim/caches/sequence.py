"""VertexCache ↔ a numbered file a frame: walk_00001.ply, walk_00002.ply, …; a single frame is walk.ply itself."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import PurePath

import numpy as np

from anim.arrays import Floats, Ints
from anim.caches import raw, still
from anim.caches.files import Inputs, Outputs, suffix, whole
from anim.caches.settings import Reading, Writing, Written
from anim.errors import FormatError
from anim.model import Chunk, VertexCache

DEFAULT_FPS = 24.0  # for files of others, which say nothing
HEAD = 1024  # bytes in which our remark lies


def read(inputs: Inputs, reading: Reading) -> VertexCache:
    """Return the frames that belong together: of walk.ply if it is there, else of all walk_*.ply in order.

    Frames that a longer sequence of ours left behind a shorter one are no part of it: the first file says how many are.
    Times are those that our own files say, else frames at `reading.fps` or 24 per second. The first frame gives the
    faces; every other must have as many vertices.
    """
    names = _members(inputs)
    with whole(inputs, names[0]) as data:
        first = still.read(data, suffix(names[0]))
    count = first.remark.get("frames", "")
    names = names[: int(count)] if count.isdecimal() and int(count) else names
    return VertexCache(
        _times(inputs, names, reading.fps),
        len(first.positions),
        first.faces,
        lambda: _chunks(inputs, names, len(first.positions), first.normals is not None),
        has_normals=first.normals is not None,
        up=first.remark.get("up", "y"),
    )


def write(cache: VertexCache, outputs: Outputs, writing: Writing) -> Written:
    """Write a file a frame, numbered from 1, or the main file itself where there is only one."""
    ending = suffix(outputs.main)
    faces: Ints = cache.faces
    for chunk in cache.chunks():
        for i, positions in enumerate(chunk.positions):
            frame = chunk.first + i
            normals = chunk.normals[i] if chunk.normals is not None and ending != ".stl" else None
            remark = {"time": f"{cache.times[frame]:.9g}", "up": cache.up, "frames": str(cache.frame_count)}
            name = outputs.main if cache.frame_count == 1 else numbered(outputs.main, frame + 1)
            with outputs.create(name) as file:
                file.write(still.write(still.Still(positions, faces, normals, remark), ending))
    notes = ("STL keeps no order of vertices: each triangle has three of its own",) if ending == ".stl" else ()
    return Written(notes=notes)


def numbered(name: str, number: int) -> str:
    """Return the name of a frame's file: numbered("walk.ply", 7) → "walk_00007.ply"."""
    return f"{_stem(name)}_{number:05d}{suffix(name)}"


def _stem(name: str) -> str:
    return re.sub(r"_\d+$", "", PurePath(name).stem)


def _members(inputs: Inputs) -> Sequence[str]:
    names = inputs.names()
    is_numbered = re.search(r"_\d+$", PurePath(inputs.main).stem) is not None
    if inputs.main in names and not is_numbered:
        return [inputs.main]
    pattern = re.compile(re.escape(_stem(inputs.main)) + r"_(\d+)" + re.escape(PurePath(inputs.main).suffix))
    found = sorted((int(match[1]), name) for name in names if (match := pattern.fullmatch(name)))
    if not found:
        raise FormatError(f"is not there, nor is {numbered(inputs.main, 1)}")
    return [name for _, name in found]


def _times(inputs: Inputs, names: Sequence[str], fps: float | None) -> Floats:
    said = []
    for name in names:
        with inputs.open(name) as file:
            said.append(still.remark_of(file.read(HEAD)).get("time"))
    if fps is None and None not in said:
        try:
            times = np.array(said, np.float64)
        except ValueError:
            times = np.zeros(len(names))
        if np.isfinite(times).all() and times[0] >= 0 and (np.diff(times) > 0).all():
            return times
    return np.arange(len(names)) / (fps or DEFAULT_FPS)


def _chunks(inputs: Inputs, names: Sequence[str], vertices: int, has_normals: bool) -> Iterator[Chunk]:
    step = raw.per_chunk(vertices)
    for first in range(0, len(names), step):
        stills = []
        for name in names[first : first + step]:
            with whole(inputs, name) as data:
                frame = still.read(data, suffix(name))
            if len(frame.positions) != vertices:
                raise FormatError(f"'{name}' has {len(frame.positions)} vertices (the first has {vertices})")
            if has_normals and frame.normals is None:
                raise FormatError(f"'{name}' has no normals (the first has)")
            stills.append(frame)
        normals = np.stack([f.normals for f in stills if f.normals is not None]) if has_normals else None
        yield Chunk(first, np.stack([frame.positions for frame in stills]), normals)
