"""Chunks of frames out of layers, made by a crew of threads that is a chunk ahead of whoever asks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from itertools import cycle, pairwise
from typing import Any, NamedTuple, TypeAlias

from anim.arrays import Floats
from anim.model import Chunk, Clip, Skeleton
from anim.skinning.buffers import Buffers
from anim.skinning.crew import Crew
from anim.skinning.frames import Frames, Playback
from anim.skinning.kernels.lanes import LANES, NOTHING, Target
from anim.skinning.layer import Layer

Piece: TypeAlias = tuple[Layer, Any, slice, int, int]  # a layer, what it packed, its block, first and last vertex

CHUNK = 1 << 23  # bytes of positions in a chunk, about; never less than LANES frames
MOST = 32  # blocks of LANES frames in a chunk, for their poses take memory too
PIECE = 4096  # vertices for which it is worth to wake a thread
PACKED = 1 << 22  # bytes of what is packed at a time, about; never less than for a chunk


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

        While the caller uses one chunk the next is made, and the one after it is asked for before that is done, so that
        no thread has to wait. Three lie in memory at most: a caller may let go of a chunk only when it gets the next.
        """
        blocks = min(CHUNK // (12 * self.vertices * LANES), MOST, -(-len(times) // LANES))
        step = LANES * max(blocks, 1)
        with Crew(self.threads) as crew:
            packed = self._ahead(Playback(self.skeleton, clip), times, step, crew)
            making = (self._begun(each, crew) for each in packed)
            following, first = next(making, None), 0
            while following is not None:
                begun = following
                following = next(making, None)  # before a thread runs out of work
                chunk = self._finished(first, begun, crew)
                del begun
                yield chunk
                first += len(chunk.positions)
                del chunk  # so that its memory can be used again
                progress(first)

    def _ahead(self, playback: Playback, times: Floats, step: int, crew: Crew) -> Iterator[_Packed]:
        """Yield chunks, packed for one stretch of time while those of the stretch before are made."""
        size = 96 * len(self.skeleton) + sum(layer.packed_size for layer in self.layers)
        spans = stretches(len(times), step, PACKED // max(size, 1))
        futures = (crew.submit(self._stretch, playback, times[span], step) for span in spans)
        coming = next(futures, None)
        while coming is not None:
            packed = crew.result(coming)
            coming = next(futures, None)
            yield from packed

    def _stretch(self, playback: Playback, times: Floats, step: int) -> list[_Packed]:
        """Sample the poses of some chunks, and pack what each layer needs for each block of frames; share that out."""
        frames = playback.at(times)
        return [self._shared(frames.part(slice(low, low + step))) for low in range(0, len(times), step)]

    def _shared(self, frames: Frames) -> _Packed:
        shares: list[list[Piece]] = [[] for _ in range(self.threads)]
        turn = cycle(shares)
        for layer in self.layers:
            vertices = len(layer.rig.points)
            pieces = min(-(-vertices // PIECE), self.threads)
            ends = [vertices * i // pieces for i in range(pieces + 1)]
            for block in (slice(low, low + LANES) for low in range(0, len(frames.times), LANES)):
                parts = layer.pack(frames, block)
                for first, last in pairwise(ends):
                    next(turn).append((layer, parts, block, first, last))
        return _Packed(frames, [share for share in shares if share])

    def _begun(self, packed: _Packed, crew: Crew) -> _Begun:
        """Have threads make a chunk. Memory is asked for only here, when the caller has let go of an earlier one."""
        frames, shares = packed
        shape = (len(frames.times), self.vertices, 3)
        wanted = (True, self.normals, self.tangents)
        whole = Target(0, *(self.buffers.array(*shape) if each else NOTHING for each in wanted))
        return _Begun(frames, whole, [crew.submit(_place, share, whole) for share in shares])

    def _finished(self, first: int, begun: _Begun, crew: Crew) -> Chunk:
        for job in begun.jobs:
            crew.result(job)
        for layer in self.layers:
            layer.finish(begun.frames, begun.whole)
        _, positions, normals, tangents = begun.whole
        return Chunk(first, positions, normals if self.normals else None, tangents if self.tangents else None)


def stretches(frames: int, step: int, most: int) -> Iterator[slice]:
    """Yield parts of so many frames, of whole chunks of `step`: one, and then twice as many each time up to `most`.

    The first is short, so that work begins soon. The later ones are long, for the code that packs is out of the
    processor's caches when vertices have gone through them, and takes three times as long then (measured).
    """
    low, size = 0, step
    while low < frames:
        yield slice(low, low + size)
        low, size = low + size, min(2 * size, max(most - most % step, step))


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
