"""VertexCache ↔ .mdd, LightWave's point cache: big-endian, with the time of every frame.

int32 frames, int32 points, float32 seconds of each frame, then float32 xyz of every point, frame by frame. A companion
rest mesh has the same order of vertices.
"""

from __future__ import annotations

import struct

import numpy as np

from anim.caches import frame_blocks, rest_mesh
from anim.caches.options import ReadOptions, WriteOptions, WriteResult
from anim.caches.storage import Inputs, Outputs, read_exactly
from anim.errors import DataRangeError, FormatError
from anim.model import VertexCache

HEADER = struct.Struct(">ii")


def read(inputs: Inputs, reading: ReadOptions) -> VertexCache:
    """Return the cache in the main file, with the faces of its rest mesh if there is one."""
    with inputs.open(inputs.main) as file:
        frames, points = HEADER.unpack(read_exactly(file, HEADER.size, "the header"))
        frame_blocks.check_size(file, HEADER.size + 4 * max(frames, 0), frames, points)
        times = np.frombuffer(read_exactly(file, 4 * frames, "the list of times"), ">f4").astype(np.float64)
    if not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        raise FormatError("times are not increasing")
    header = HEADER.size + 4 * frames
    beside = rest_mesh.read(inputs, header, frames, points, reading.note)
    return VertexCache(
        times - min(times[0], 0.0),
        points,
        beside.faces,
        lambda: frame_blocks.chunks(inputs, header, frames, points, ">f4"),
        rest=beside.positions,
        up=beside.up,
    )


def write(cache: VertexCache, outputs: Outputs, writing: WriteOptions) -> WriteResult:
    """Write the cache and its rest mesh; times become float32. Raises DataRangeError where two become equal."""
    times = cache.times.astype(">f4")
    if len(equal := np.flatnonzero(np.diff(times) <= 0)):
        i = int(equal[0])
        raise DataRangeError(
            f"frames {i} and {i + 1}, {cache.times[i + 1] - cache.times[i]:.3g} s apart, are at one time in float32",
            help="choose a frame rate with `fps`",
        )
    with outputs.create(outputs.main) as file:
        file.write(HEADER.pack(cache.frame_count, cache.vertex_count))
        file.write(times.tobytes())
        mark = frame_blocks.write(cache, file, ">f4")
    rest_mesh.write(cache, outputs, writing.rest_mesh, mark)
    return WriteResult()
