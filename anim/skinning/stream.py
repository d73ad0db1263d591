"""Chunks of frames out of layers, made by a pool of threads that is some chunks ahead of whoever asks."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass

from anim.arrays import Floats
from anim.model import Chunk, Clip, Skeleton
from anim.skinning.buffers import Buffers
from anim.skinning.frames import Frames, Playback
from anim.skinning.kernels.lanes import LANES, NOTHING, Target
from anim.skinning.layer import PIECE, Layer

CHUNK = 1 << 23  # bytes of positions in a chunk, about; never less than LANES frames
MOST = 32  # blocks of LANES frames in a chunk, for their poses take memory too
AHEAD = 2  # chunks that are under way


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
        """Yield the frames at `times` (F,) s in order. progress: called with how many the caller is done with."""
        blocks = min(CHUNK // (12 * self.vertices * LANES), MOST, -(-len(times) // LANES))
        step = LANES * max(blocks, 1)
        playback = Playback(self.skeleton, clip)
        with ThreadPoolExecutor(self.threads) as pool, ThreadPoolExecutor(1) as sampler:
            ahead: deque[Future[_Begun]] = deque()
            for first in range(-AHEAD * step, len(times), step):
                following = times[max(first + AHEAD * step, 0) :][:step]
                if len(following):
                    ahead.append(sampler.submit(self._begin, playback, following, pool))
                if first >= 0:
                    yield self._finished(first, ahead.popleft().result())
                    progress(min(first + step, len(times)))

    def _begin(self, playback: Playback, times: Floats, pool: Executor) -> _Begun:
        """Sample the poses of a chunk and set its blocks going."""
        shape = (len(times), self.vertices, 3)
        wanted = (True, self.normals, self.tangents)
        whole = Target(0, *(self.buffers.array(*shape) if each else NOTHING for each in wanted))
        blocks = [slice(low, low + LANES) for low in range(0, len(times), LANES)]
        begun = _Begun(playback.at(times), whole, [])
        begun.blocks.extend(
            pool.submit(_placing, begun, layer, block, pool) for layer in self.layers for block in blocks
        )
        return begun

    def _finished(self, first: int, begun: _Begun) -> Chunk:
        for block in begun.blocks:
            for piece in block.result():
                piece.result()
        for layer in self.layers:
            layer.finish(begun.frames, begun.whole)
        _, positions, normals, tangents = begun.whole
        return Chunk(first, positions, normals if self.normals else None, tangents if self.tangents else None)


@dataclass(frozen=True, slots=True)
class _Begun:
    """A chunk under way: the pieces of each block are known when its matrices are packed."""

    frames: Frames
    whole: Target
    blocks: list[Future[list[Future[None]]]]


def _placing(begun: _Begun, layer: Layer, block: slice, pool: Executor) -> list[Future[None]]:
    """Pack what a layer needs for a block of frames, and set its pieces going; nothing here waits for another."""
    packed = layer.pack(begun.frames, block)
    starts = range(0, len(layer.rig.points), PIECE)
    return [pool.submit(layer.place, packed, block, begun.whole, start) for start in starts]
