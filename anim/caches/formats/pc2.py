"""VertexCache ↔ .pc2, the point cache of 3ds Max and Blender: little-endian, without a frame rate.

32 bytes: "POINTCACHE2\\0", int32 version 1, int32 points, float32 start frame, float32 frames per sample, int32
samples; then float32 xyz of every point, sample by sample (like Blender's own exporter). A companion rest mesh has its
vertices in the same order and stores the frame rate in a comment.
"""

from __future__ import annotations

import struct

import numpy as np

from anim.arrays import Floats
from anim.caches import frame_blocks, rest_mesh
from anim.caches.options import ReadOptions, WriteOptions, WriteResult
from anim.caches.storage import Inputs, Outputs, read_exactly
from anim.caches.transforms import statistics
from anim.errors import FormatError, RangeError
from anim.model import VertexCache

MAGIC = b"POINTCACHE2\0"
HEADER = struct.Struct("<12siiffi")
DEFAULT_FPS = 24.0  # Blender's default, for files of other programs, which have no rate


def read(inputs: Inputs, reading: ReadOptions) -> VertexCache:
    """Return the cache in the main file, with the faces of its rest mesh if there is one.

    Frames per second: `reading.input_fps`, or the rest mesh's, or 24.
    """
    with inputs.open(inputs.main) as file:
        data = read_exactly(file, HEADER.size, "the header")
        magic, version, points, start, step, samples = HEADER.unpack(data)
        if magic != MAGIC or version != 1:
            raise FormatError(f"is no PC2: starts with {magic!r}, version {version} (expected {MAGIC!r}, 1)")
        if not (np.isfinite(start) and np.isfinite(step) and step > 0):
            raise FormatError(f"header has start frame {start:g} and {step:g} frames per sample")
        frame_blocks.check_size(file, HEADER.size, samples, points)
    beside = rest_mesh.read(inputs, HEADER.size, samples, points, reading.note)
    fps = reading.input_fps or beside.fps or DEFAULT_FPS
    times = np.round((start + step * np.arange(samples)) / fps, 9)
    return VertexCache(
        times - min(times[0], 0.0),
        points,
        beside.faces,
        lambda: frame_blocks.chunks(inputs, HEADER.size, samples, points, "<f4"),
        rest=beside.positions,
        up=beside.up,
    )


def write(cache: VertexCache, outputs: Outputs, writing: WriteOptions) -> WriteResult:
    """Write the cache and its rest mesh. Raises RangeError for frames at uneven steps."""
    fps, notes = _rate(cache.times)
    notes += (f"PC2 keeps no frame rate: play it at {fps:g} frames per second",)
    start = round(float(cache.times[0]) * fps, 6)
    with outputs.create(outputs.main) as file:
        file.write(HEADER.pack(MAGIC, 1, cache.vertex_count, start, 1.0, cache.frame_count))
        mark = frame_blocks.write(cache, file, "<f4")
    rest_mesh.write(cache, outputs, writing.rest_mesh, mark, fps=fps)
    return WriteResult(notes=notes)


def _rate(times: Floats) -> tuple[float, tuple[str, ...]]:
    """Frames per second, and notes about the last frame, which may be early at a clip's end."""
    if len(times) == 1:
        return DEFAULT_FPS, ()
    step, off = statistics.frame_spacing(times)
    if off[:-1].max() > statistics.GRID_TOLERANCE_FRAMES:
        k = int(np.argmax(off[:-1] > statistics.GRID_TOLERANCE_FRAMES))
        raise RangeError(
            f"PC2 has frames at even steps, and frame {k} at {times[k]:.4g} s is off them",
            help="choose a frame rate with `fps`",
        )
    fps = float(f"{1 / step:.6g}")
    if off[-1] > statistics.GRID_TOLERANCE_FRAMES:
        return fps, (f"{statistics.last_frame_note(times, off)}; PC2 shows it one step after the one before",)
    return fps, ()
