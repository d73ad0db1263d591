"""Memory doesn't grow with the number of frames: one chunk is on its way, the others are nowhere."""

from __future__ import annotations

import io
import tracemalloc
from collections.abc import Iterator
from typing import BinaryIO

import numpy as np
import pytest

from anim.caches import frame_blocks
from anim.caches.options import ReadOptions, WriteOptions
from anim.caches.registry import reader_for, writer_for
from anim.caches.storage import Memory
from anim.caches.transforms.resample import at_rate
from anim.caches.transforms.up_axis import to_up_axis
from anim.model import FrameChunk, VertexCache

FRAMES, VERTICES = 1200, 4000
WHOLE = 12 * FRAMES * VERTICES  # 57.6 MB
POSITIONS = np.random.default_rng(4).normal(size=(VERTICES, 3)).astype(np.float32)


class Nowhere(io.RawIOBase):
    """A file that only counts."""

    size = 0

    def writable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return False

    def write(self, data: object) -> int:
        count = memoryview(data).nbytes  # type: ignore[arg-type]
        self.size += count
        return count


class Sink:
    """Outputs that keep nothing."""

    def __init__(self, main: str) -> None:
        self.main = main
        self.folder = None
        self.files: dict[str, Nowhere] = {}

    def create(self, name: str) -> BinaryIO:
        self.files[name] = Nowhere()
        return self.files[name]  # type: ignore[return-value]


def frames() -> Iterator[FrameChunk]:
    for first in range(0, FRAMES, 4):
        yield FrameChunk(first, POSITIONS + np.arange(first, first + 4, dtype=np.float32)[:, None, None])


SOURCE = VertexCache(np.arange(FRAMES) / 30, VERTICES, np.arange(3999).reshape(-1, 3), frames)


@pytest.mark.parametrize("name", ["a.pc2", "a.mdd", "a.npz", "a.ply"])
def test_writers_hold_a_chunk(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("frame_blocks", "formats.npz"):
        monkeypatch.setattr(f"anim.caches.{module}.COPY_BYTES", 1 << 20)
    writer_for(".ply")(SOURCE, Sink("warm.ply"), WriteOptions())  # imports are not what is measured
    sink = Sink(name)
    tracemalloc.start()
    writer_for(name[1:])(to_up_axis(at_rate(SOURCE, 15), "z"), sink, WriteOptions())
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert sum(file.size for file in sink.files.values()) >= WHOLE / 2
    assert peak < WHOLE / 3


@pytest.mark.parametrize("name", ["a.pc2", "a.mdd", "a.npz"])
def test_readers_hold_a_chunk(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("frame_blocks", "formats.npz"):
        monkeypatch.setattr(f"anim.caches.{module}.COPY_BYTES", 1 << 20)
    assert frame_blocks.per_chunk(VERTICES) == 21
    files = Memory(name)
    writer_for(name[1:])(SOURCE, files, WriteOptions())
    cache = reader_for(name[1:])(files, ReadOptions())
    tracemalloc.start()
    count = sum(len(chunk.positions) for chunk in cache.chunks())
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert count == FRAMES
    assert peak < WHOLE / 3
