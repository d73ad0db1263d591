"""Caches that tests write, and the way through a format and back."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import trimesh

from anim.arrays import AnyArray
from anim.caches.options import ReadOptions, WriteOptions, WriteResult
from anim.caches.registry import reader_for, writer_for
from anim.caches.storage import Memory
from anim.model import FrameChunk, MeshPart, VertexCache

FACES = np.array([[0, 1, 2], [2, 1, 3], [4, 6, 5], [5, 6, 7]])
PARTS = (MeshPart("one", (0, 4), (0, 2), 3, 0), MeshPart("two", (4, 9), (2, 4), 5, 1))


def cache(
    frames: int = 7, *, fps: float = 30.0, normals: bool = True, step: int = 3, tangents: bool = False
) -> VertexCache:
    """Return a cache of nine vertices, the last one in no face, that comes in chunks of `step` frames.

    tangents: at right angles to the normals, every third one left-handed.
    """
    random = np.random.default_rng(11)
    positions = random.normal(size=(frames, 9, 3)).astype(np.float32)
    turns = random.normal(size=(frames, 9, 3))
    turns = (turns / np.linalg.norm(turns, axis=2, keepdims=True)).astype(np.float32)
    along = np.cross(turns, turns[:, :, [1, 2, 0]])
    along = (along / np.linalg.norm(along, axis=2, keepdims=True)).astype(np.float32)
    handedness = np.where(np.arange(9) % 3, 1.0, -1.0)
    return VertexCache(
        np.arange(frames) / fps,
        9,
        FACES,
        lambda: (
            FrameChunk(
                f,
                positions[f : f + step],
                turns[f : f + step] if normals else None,
                along[f : f + step] if tangents else None,
            )
            for f in range(0, frames, step)
        ),
        rest=positions[0].astype(np.float64) + 0.5,
        has_normals=normals,
        parts=PARTS,
        handedness=handedness if tangents else None,
    )


def smooth(frames: int = 40, vertices: int = 60) -> VertexCache:
    """Return a cache that few shapes give: each vertex on its own ellipse, with a drift."""
    random = np.random.default_rng(5)
    a, b, c = random.normal(size=(3, vertices, 3))
    t = np.linspace(0, 2 * np.pi, frames)[:, None, None]
    positions = (a + 0.3 * np.sin(t) * b + 0.2 * np.cos(t) * c).astype(np.float32)
    faces = np.arange(vertices).reshape(-1, 3)
    return VertexCache(np.arange(frames) / 24, vertices, faces, lambda: iter((FrameChunk(0, positions),)))


def written(cache: VertexCache, name: str, writing: WriteOptions | None = None) -> tuple[Memory, WriteResult]:
    """Return the files that a cache becomes under this name, and what the writer said."""
    files = Memory(name)
    ending = name[name.rindex(".") :]
    return files, writer_for(ending)(cache, files, writing or WriteOptions())


def opened(files: Memory, reading: ReadOptions | None = None) -> VertexCache:
    """Return the cache in files."""
    return reader_for(files.main[files.main.rindex(".") :])(files, reading or ReadOptions())


def off(one: VertexCache, other: VertexCache) -> float:
    """Return how far the farthest vertex of one is from the other's, in m."""
    return float(
        np.linalg.norm(one.load_all().positions.astype(np.float64) - other.load_all().positions, axis=-1).max()
    )


def positions_of(cache: VertexCache) -> AnyArray:
    """Return all positions (F, V, 3)."""
    return cache.load_all().positions


def normals_of(cache: VertexCache) -> AnyArray:
    """Return all normals (F, V, 3), which have to be there."""
    normals = cache.load_all().normals
    assert normals is not None
    return normals


def by_trimesh(data: bytes, ending: str) -> Any:
    """Return the mesh that trimesh reads from the bytes of a file."""
    return trimesh.load(io.BytesIO(data), file_type=ending[1:], process=False, maintain_order=True)
