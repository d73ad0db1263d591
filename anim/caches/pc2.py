"""VertexCache ↔ .pc2, the point cache of 3ds Max and Blender: little-endian, even steps, no frame rate.

32 bytes: "POINTCACHE2\\0", int32 version 1, int32 points, float32 start frame, float32 frames per sample, int32
samples; then float32 xyz of every point, sample by sample (as Blender's own exporter writes it). A rest mesh beside it
has its vertices in the same order and keeps the frame rate in a comment.
"""

from __future__ import annotations

import struct

import numpy as np

from anim.arrays import Floats
from anim.caches import raw, rest
from anim.caches.files import Inputs, Outputs, read_exactly
from anim.caches.settings import Reading, Writing, Written
from anim.errors import FormatError, RangeError
from anim.model import VertexCache

MAGIC = b"POINTCACHE2\0"
HEADER = struct.Struct("<12siiffi")
DEFAULT_FPS = 24.0  # Blender's own default, for files of others that say nothing
EVEN = 1e-3  # share of a step by which frames may be off their grid


def read(inputs: Inputs, reading: Reading) -> VertexCache:
    """Return the cache in the main file, with the faces of the rest mesh beside it where there is one.

    Frames per second: `reading.fps`, or what the rest mesh says, or 24.
    """
    with inputs.open(inputs.main) as file:
        data = read_exactly(file, HEADER.size, "the header")
        magic, version, points, start, step, samples = HEADER.unpack(data)
        if magic != MAGIC or version != 1:
            raise FormatError(f"is no PC2: starts with {magic!r}, version {version} (expected {MAGIC!r}, 1)")
        if not (np.isfinite(start) and np.isfinite(step) and step > 0):
            raise FormatError(f"header has start frame {start:g} and {step:g} frames per sample")
        raw.check_size(file, HEADER.size, samples, points)
    beside = rest.read(inputs, points)
    fps = reading.fps or beside.fps or DEFAULT_FPS
    times = np.round((start + step * np.arange(samples)) / fps, 9)
    return VertexCache(
        times - min(times[0], 0.0),
        points,
        beside.faces,
        lambda: raw.chunks(inputs, HEADER.size, samples, points, "<f4"),
        rest=beside.positions,
        up=beside.up,
    )


def write(cache: VertexCache, outputs: Outputs, writing: Writing) -> Written:
    """Write the cache and a rest mesh beside it. Raises RangeError where frames don't come at even steps."""
    fps, notes = _rate(cache.times)
    notes += (f"PC2 keeps no frame rate: play it at {fps:g} frames per second",)
    start = round(float(cache.times[0]) * fps, 6)
    with outputs.create(outputs.main) as file:
        file.write(HEADER.pack(MAGIC, 1, cache.vertex_count, start, 1.0, cache.frame_count))
        raw.write(cache, file, "<f4")
    rest.write(cache, outputs, writing.rest, fps=fps)
    return Written(notes=notes)


def _rate(times: Floats) -> tuple[float, tuple[str, ...]]:
    """Frames per second, and what has to be said about the last frame, which may come early at a clip's end."""
    if len(times) == 1:
        return DEFAULT_FPS, ()
    step = float(times[1] - times[0])
    if len(times) > 2 and round(float(times[-2] - times[0]) / step) == len(times) - 2:
        step = float(times[-2] - times[0]) / (len(times) - 2)  # rounding of the first step would add up
    off = np.abs(times - times[0] - step * np.arange(len(times))) / step
    if len(times) > 2 and off[:-1].max() > EVEN:
        k = int(np.argmax(off[:-1] > EVEN))
        raise RangeError(
            f"PC2 has frames at even steps, and frame {k} at {times[k]:.4g} s is off them", help="choose --fps"
        )
    fps = float(f"{1 / step:.6g}")
    if off[-1] > EVEN:
        late = f"the last frame is at {times[-1]:.4g} s, {off[-1]:.2g} steps off"
        return fps, (f"{late}; PC2 shows it one step after the one before",)
    return fps, ()
