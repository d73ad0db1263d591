"""Pipeline of frame chunks: a thread pool skins one chunk while the caller uses the previous one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from itertools import cycle, pairwise
from typing import Any, TypeAlias

import numpy as np

from anim.arrays import Floats
from anim.memory import MemoryBudget
from anim.model import Clip, FrameChunk, Skeleton
from anim.sampling.pose import PosedSkeleton, PoseSampler
from anim.skinning.bound_mesh import BoundMesh
from anim.skinning.kernels.layout import LANES, NO_OUTPUT, OutputSlice

Job: TypeAlias = tuple[BoundMesh, Any, slice, int, int]  # a layer, its packed data, its block, first and last vertex

CHUNK_BYTES = 1 << 23  # approximate size of positions in a chunk; never less than LANES frames
PACKED_BYTES = 1 << 22  # approximate size of a chunk's matrices and morphed vertices
MAX_BLOCKS = 32  # of LANES frames in a chunk; their poses take memory too
MIN_VERTICES = 4096  # per thread
MAX_VERTICES_ALONE = 4096  # of all frames: to start threads for fewer takes longer than to skin them


def count_frame_bytes(skeleton: Skeleton, layers: Sequence[BoundMesh]) -> int:
    """Return the bytes of a frame's matrices and morphed vertices.

    Raises UnsupportedError if those of the smallest chunks are above the limit of memory.
    """
    packed = 96 * len(skeleton) + sum(layer.packed_size for layer in layers)
    MemoryBudget(0).check(2 * LANES * packed)  # of two chunks at least
    return packed


@dataclass(frozen=True, slots=True)
class ChunkPipeline:
    """Skinning of `vertices` columns by layers. threads: number of workers, without effect on the result."""

    skeleton: Skeleton
    layers: Sequence[BoundMesh]
    vertices: int
    normals: bool
    tangents: bool
    threads: int

    def chunks(self, clip: Clip, times: Floats, progress: Callable[[int], None]) -> Iterator[FrameChunk]:
        """Yield the frames at `times` (F,) s in order. progress: called with the number of frames used.

        While the caller uses one chunk the next is skinned, and the poses of the one after it are sampled.
        """
        sampler, step = PoseSampler(self.skeleton, clip), self._frames_per_chunk()
        if 0 < len(times) <= step and len(times) * self.vertices <= MAX_VERTICES_ALONE:
            yield self._finish(0, self._start(sampler.posed(times), None))
            progress(len(times))
            return
        with ThreadPoolExecutor(self.threads, thread_name_prefix="skinning") as pool:
            spans = (times[low : low + step] for low in range(0, len(times), step))
            started = (self._start(sampler.posed(span), pool) for span in spans)
            following, first = next(started, None), 0
            while following is not None:
                current, following = following, next(started, None)
                chunk = self._finish(first, current)
                yield chunk
                first += len(chunk.positions)
                progress(first)

    def _frames_per_chunk(self) -> int:
        packed = count_frame_bytes(self.skeleton, self.layers)
        blocks = min(CHUNK_BYTES // (12 * self.vertices * LANES), PACKED_BYTES // (packed * LANES), MAX_BLOCKS)
        return LANES * max(blocks, 1)

    def _start(self, frames: PosedSkeleton, pool: ThreadPoolExecutor | None) -> _PendingChunk:
        """Return a chunk that is skinned by the pool, or that is skinned already."""
        shape = (len(frames.times), self.vertices, 3)
        wanted = (True, self.normals, self.tangents)
        whole = OutputSlice(0, *(np.empty(shape, np.float32) if each else NO_OUTPUT for each in wanted))
        shares = self._thread_jobs(frames)
        if pool is not None:
            return _PendingChunk(frames, whole, [pool.submit(_submit, jobs, whole) for jobs in shares])
        for jobs in shares:
            _submit(jobs, whole)
        return _PendingChunk(frames, whole, [])

    def _thread_jobs(self, frames: PosedSkeleton) -> list[list[Job]]:
        """Return the jobs of each thread: vertices of large layers are divided, in blocks of frames."""
        shares: list[list[Job]] = [[] for _ in range(self.threads)]
        next_share = cycle(shares)
        for layer in self.layers:
            vertices = len(layer.rig.points)
            num_parts = min(-(-vertices // MIN_VERTICES), self.threads)
            ends = [vertices * i // num_parts for i in range(num_parts + 1)]
            for block in (slice(low, low + LANES) for low in range(0, len(frames.times), LANES)):
                parts = layer.pack(frames, block)
                for first, last in pairwise(ends):
                    next(next_share).append((layer, parts, block, first, last))
        return [jobs for jobs in shares if jobs]

    def _finish(self, first: int, started: _PendingChunk) -> FrameChunk:
        for future in started.futures:
            future.result()
        for layer in self.layers:
            layer.finish(started.frames, started.output)
        _, positions, normals, tangents = started.output
        directions = (normals if self.normals else None, tangents if self.tangents else None)
        return FrameChunk(first, positions, *directions).check_finite()


@dataclass(frozen=True, slots=True)
class _PendingChunk:
    """A chunk in progress."""

    frames: PosedSkeleton
    output: OutputSlice
    futures: list[Future[None]]


def _submit(jobs: list[Job], whole: OutputSlice) -> None:
    for layer, parts, block, first, last in jobs:
        layer.skin(parts, block, whole, first, last)
