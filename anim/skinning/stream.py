"""Chunks of frames out of layers, made by a pool of threads that is a chunk ahead of whoever asks."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass
from itertools import cycle, islice, pairwise
from typing import Any, NamedTuple, TypeAlias

from anim.arrays import Floats
from anim.model import Chunk, Clip, Skeleton
from anim.skinning.buffers import Buffers
from anim.skinning.frames import Frames, Playback
from anim.skinning.kernels.lanes import LANES, NOTHING, Target
from anim.skinning.layer import Layer

Piece: TypeAlias = tuple[Layer, Any, slice, int, int]  # a layer, what it packed, its block, first and last vertex

CHUNK = 1 << 23  # bytes of positions in a chunk, about; never less than LANES frames
MOST = 32  # blocks of LANES frames in a chunk, for their poses take memory too
PIECE = 4096  # vertices for which it is worth to wake a thread
AHEAD = 2  # chunks that are packed before they are begun


@dataclass(frozen=True, slots=True)
class Stream:
    """What is made: `vertices` columns by these layers. threads: how many work on it, without any change of a bit."""

    skeleton: Skeleton
    layers: Sequence[Layer]
    vertices: int
    normals: bool
    tangents: bool
    threads: int
    buffers: Buffers

    def chunks(self, clip: Clip, times: Floats, progress: Callable[[int], None]) -> Iterator[Chunk]:
        """Yield the frames at `times` (F,) s in order. progress: called with how many the caller is done with.

        All threads work on one chunk, while another is used and the poses of the next ones are sampled: two lie in
        memory, which caches hold where three would not (a fifth of the time, measured).
        """
        blocks = min(CHUNK // (12 * self.vertices * LANES), MOST, -(-len(times) // LANES))
        step = LANES * max(blocks, 1)
        starts = range(0, len(times), step)
        playback = Playback(self.skeleton, clip)
        with ThreadPoolExecutor(self.threads) as pool:
            packed = (pool.submit(self._packed, playback, times[first:][:step]) for first in starts)
            ahead = deque(islice(packed, AHEAD))
            going = pool.submit(self._begun, ahead, packed, pool)
            for first in starts:
                chunk = self._finished(first, going.result())
                if ahead:
                    going = pool.submit(self._begun, ahead, packed, pool)
                yield chunk
                del chunk  # so that its memory can be used again
                progress(min(first + step, len(times)))

    def _packed(self, playback: Playback, times: Floats) -> _Packed:
        """Sample the poses of a chunk, and pack what each layer needs for each block of frames; share that out."""
        frames = playback.at(times)
        shares: list[list[Piece]] = [[] for _ in range(self.threads)]
        turn = cycle(shares)
        for layer in self.layers:
            vertices = len(layer.rig.points)
            pieces = min(-(-vertices // PIECE), self.threads)
            ends = [vertices * i // pieces for i in range(pieces + 1)]
            for block in (slice(low, low + LANES) for low in range(0, len(times), LANES)):
                parts = layer.pack(frames, block)
                for first, last in pairwise(ends):
                    next(turn).append((layer, parts, block, first, last))
        return _Packed(frames, [share for share in shares if share])

    def _begun(self, ahead: deque[Future[_Packed]], more: Iterator[Future[_Packed]], pool: Executor) -> _Begun:
        """Set all threads to the first chunk ahead, this one too, and then to packing one more.

        Memory is asked for only here, when the caller has let go of the chunk before.
        """
        frames, (own, *others) = ahead.popleft().result()
        shape = (len(frames.pose.times), self.vertices, 3)
        wanted = (True, self.normals, self.tangents)
        whole = Target(0, *(self.buffers.array(*shape) if each else NOTHING for each in wanted))
        jobs = [pool.submit(_place, share, whole) for share in others]
        ahead.extend(islice(more, 1))
        _place(own, whole)
        return _Begun(frames, whole, jobs)

    def _finished(self, first: int, begun: _Begun) -> Chunk:
        for job in begun.jobs:
            job.result()
        for layer in self.layers:
            layer.finish(begun.frames, begun.whole)
        _, positions, normals, tangents = begun.whole
        return Chunk(first, positions, normals if self.normals else None, tangents if self.tangents else None)


class _Packed(NamedTuple):
    """A chunk's frames, and for each thread its pieces of the layers."""

    frames: Frames
    shares: list[list[Piece]]


@dataclass(frozen=True, slots=True)
class _Begun:
    """A chunk that is being written, and what the other threads do about it."""

    frames: Frames
    whole: Target
    jobs: list[Future[None]]


def _place(share: list[Piece], whole: Target) -> None:
    for layer, parts, block, first, last in share:
        layer.place(parts, block, whole, first, last)
