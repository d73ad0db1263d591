"""Chunks of frames out of layers: a pool of threads skins one chunk while the caller uses the one before."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from itertools import cycle, pairwise
from typing import Any, TypeAlias

import numpy as np

from anim.arrays import Floats
from anim.model import Clip, FrameChunk, Skeleton
from anim.skinning.bound_mesh import BoundMesh
from anim.skinning.kernels.layout import LANES, NOTHING, OutputSlice
from anim.skinning.pose_blocks import PoseBlock, PosePlayback

Job: TypeAlias = tuple[BoundMesh, Any, slice, int, int]  # a layer, what it packed, its block, first and last vertex

CHUNK_BYTES = 1 << 23  # of positions in a chunk, about; never less than LANES frames
PACKED_BYTES = 1 << 22  # of matrices and morphed vertices that a chunk needs, about
MAX_BLOCKS = 32  # of LANES frames in a chunk, for their poses take memory too
MIN_VERTICES = 4096  # for which it is worth to wake a thread


@dataclass(frozen=True, slots=True)
class ChunkPipeline:
    """What is made: `vertices` columns by these layers. threads: how many work on it, without any change of a bit."""

    skeleton: Skeleton
    layers: Sequence[BoundMesh]
    vertices: int
    normals: bool
    tangents: bool
    threads: int

    def chunks(self, clip: Clip, times: Floats, progress: Callable[[int], None]) -> Iterator[FrameChunk]:
        """Yield the frames at `times` (F,) s in order. progress: called with how many the caller is done with.

        While the caller uses one chunk the next is skinned, and the poses of the one after it are sampled.
        """
        playback, step = PosePlayback(self.skeleton, clip), self._frames_per_chunk()
        with ThreadPoolExecutor(self.threads, thread_name_prefix="skinning") as pool:
            spans = (times[low : low + step] for low in range(0, len(times), step))
            started = (self._start(playback.at(span), pool) for span in spans)
            following, first = next(started, None), 0
            while following is not None:
                current, following = following, next(started, None)
                chunk = self._finish(first, current)
                yield chunk
                first += len(chunk.positions)
                progress(first)

    def _frames_per_chunk(self) -> int:
        packed = 96 * len(self.skeleton) + sum(layer.packed_size for layer in self.layers)
        blocks = min(CHUNK_BYTES // (12 * self.vertices * LANES), PACKED_BYTES // (packed * LANES), MAX_BLOCKS)
        return LANES * max(blocks, 1)

    def _start(self, frames: PoseBlock, pool: ThreadPoolExecutor) -> _PendingChunk:
        shape = (len(frames.times), self.vertices, 3)
        wanted = (True, self.normals, self.tangents)
        whole = OutputSlice(0, *(np.empty(shape, np.float32) if each else NOTHING for each in wanted))
        return _PendingChunk(frames, whole, [pool.submit(_submit, share, whole) for share in self._shares(frames)])

    def _shares(self, frames: PoseBlock) -> list[list[Job]]:
        """Return what each thread has to do: vertices of large layers are divided, in blocks of frames."""
        shares: list[list[Job]] = [[] for _ in range(self.threads)]
        next_share = cycle(shares)
        for layer in self.layers:
            vertices = len(layer.rig.points)
            pieces = min(-(-vertices // MIN_VERTICES), self.threads)
            ends = [vertices * i // pieces for i in range(pieces + 1)]
            for block in (slice(low, low + LANES) for low in range(0, len(frames.times), LANES)):
                parts = layer.pack(frames, block)
                for first, last in pairwise(ends):
                    next(next_share).append((layer, parts, block, first, last))
        return [share for share in shares if share]

    def _finish(self, first: int, started: _PendingChunk) -> FrameChunk:
        for future in started.futures:
            future.result()
        for layer in self.layers:
            layer.finish(started.frames, started.load_all)
        _, positions, normals, tangents = started.load_all
        return FrameChunk(first, positions, normals if self.normals else None, tangents if self.tangents else None)


@dataclass(frozen=True, slots=True)
class _PendingChunk:
    """A chunk that is being written."""

    frames: PoseBlock
    load_all: OutputSlice
    futures: list[Future[None]]


def _submit(share: list[Job], whole: OutputSlice) -> None:
    for layer, parts, block, first, last in share:
        layer.skin(parts, block, whole, first, last)
