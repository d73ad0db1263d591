"""Resample or reduce the frames of a cache: vertices are linear between them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import TypeAlias

import numpy as np

from anim.arrays import AnyArray, Floats, Ints
from anim.caches.frame_blocks import per_chunk
from anim.curves.fitting.key_reduction import greedy_indices
from anim.errors import RangeError
from anim.model import FrameChunk, VertexCache
from anim.sampling import frame_times

Frame: TypeAlias = tuple[AnyArray | None, ...]  # positions, normals, tangents of one frame

SAME_FRAME_TOLERANCE_S = 1e-6  # s; closer times are the same frame
MAX_COMPARED_VALUES = 1 << 22  # at a time


def resample_frames(cache: VertexCache, times: Floats) -> VertexCache:
    """Return the cache with frames at increasing `times` (F,) in seconds, constant outside its range.

    Memory: some frames of the old cache and a chunk of the new.
    """
    if len(times) == cache.frame_count and np.abs(times - cache.times).max() < SAME_FRAME_TOLERANCE_S:
        return cache
    last = cache.frame_count - 1
    left = np.clip(np.searchsorted(cache.times, times + SAME_FRAME_TOLERANCE_S, side="right") - 1, 0, last)
    right = np.minimum(left + 1, last)
    span = cache.times[right] - cache.times[left]
    share = np.clip((times - cache.times[left]) / np.where(span > 0, span, 1.0), 0.0, 1.0)
    share[np.abs(times - cache.times[left]) < SAME_FRAME_TOLERANCE_S] = 0.0
    return replace(cache, times=times, chunks=lambda: _chunks(cache, left, right, share))


def at_rate(cache: VertexCache, fps: float) -> VertexCache:
    """Return the cache with frames at start + k / fps, and one at its end.

    Raises RangeError unless fps is above 0.
    """
    return resample_frames(cache, frame_times(float(cache.times[0]), float(cache.times[-1]), fps=fps))


def at_time(cache: VertexCache, time: float) -> VertexCache:
    """Return the cache with one frame, at `time` in seconds. Raises RangeError outside its range."""
    first, last = float(cache.times[0]), float(cache.times[-1])
    if not first - SAME_FRAME_TOLERANCE_S <= time <= last + SAME_FRAME_TOLERANCE_S:
        raise RangeError(f"there is no frame at {time:g} s (the cache goes from {first:g} s to {last:g} s)")
    return resample_frames(cache, np.array([min(max(time, first), last)]))


def _chunks(cache: VertexCache, left: Ints, right: Ints, share: Floats) -> Iterator[FrameChunk]:
    """New frames in chunks, from one pass over the old ones."""
    step = per_chunk(cache.vertex_count)
    window = _Window(cache)
    for first in range(0, len(left), step):
        rows = range(first, min(first + step, len(left)))
        found = [window.between(int(left[i]), int(right[i]), np.float32(share[i])) for i in rows]
        positions, normals, tangents = (_stack(arrays) for arrays in zip(*found, strict=True))
        assert positions is not None
        yield FrameChunk(first, positions, normals, tangents)


class _Window:
    """Window of the frames read last from a cache."""

    def __init__(self, cache: VertexCache) -> None:
        self._chunks = cache.chunks()
        self._kept: dict[int, Frame] = {}
        self._read = 0

    def between(self, left: int, right: int, share: np.float32) -> Frame:
        while self._read <= right:
            chunk = next(self._chunks)
            self._kept = {frame: arrays for frame, arrays in self._kept.items() if frame >= left}
            for i in range(len(chunk.positions)):
                self._kept[chunk.first + i] = tuple(None if each is None else each[i] for each in _arrays(chunk))
            self._read = chunk.first + len(chunk.positions)
        start, end = self._kept[left], self._kept[right]
        if share == 0 or left == right:
            return start
        mixed = [None if a is None or b is None else a + share * (b - a) for a, b in zip(start, end, strict=True)]
        return mixed[0], *(None if each is None else _unit(each) for each in mixed[1:])


def _stack(arrays: tuple[AnyArray | None, ...]) -> AnyArray | None:
    there = [each for each in arrays if each is not None]
    return np.stack(there) if len(there) == len(arrays) else None


def _arrays(chunk: FrameChunk) -> Frame:
    return chunk.positions, chunk.normals, chunk.tangents


def _unit(vectors: AnyArray) -> AnyArray:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1)


def reduce_frames(positions: AnyArray, times: Floats, limit: float) -> Ints:
    """Return the indices of frames to keep: linear interpolation reproduces the others within `limit` m.

    positions (F, V, 3). The first and the last frame are kept.
    """
    return greedy_indices(len(positions), partial(_fits, positions, times, limit))


def _fits(positions: AnyArray, times: Floats, limit: float, start: int, end: int) -> bool:
    step = max(1, MAX_COMPARED_VALUES // max(positions[0].size, 1))
    delta = positions[end] - positions[start]
    for first in range(start + 1, end, step):
        rows = slice(first, min(first + step, end))
        share = ((times[rows] - times[start]) / (times[end] - times[start])).astype(np.float32)
        off = positions[rows] - (positions[start] + share[:, None, None] * delta)
        if float(np.einsum("fvi,fvi->fv", off, off).max(initial=0.0)) > limit * limit:
            return False
    return True
