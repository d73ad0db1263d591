"""VertexCache: vertex positions per frame, streamed in chunks of frames."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from anim import arrays
from anim.arrays import AnyArray, Floats, Ints
from anim.errors import FormatError, ShapeError


@dataclass(frozen=True, slots=True, eq=False)
class FrameChunk:
    """Consecutive frames.

    first: index of the first. positions: (n, V, 3) m. normals, tangents: (n, V, 3). All float32.
    """

    first: int
    positions: AnyArray
    normals: AnyArray | None = None
    tangents: AnyArray | None = None

    def changed(self, change: Callable[[AnyArray], AnyArray]) -> FrameChunk:
        """Return the chunk with `change` applied to positions, normals and tangents."""
        turned = (None if each is None else change(each) for each in (self.normals, self.tangents))
        return FrameChunk(self.first, change(self.positions), *turned)

    def check_finite(self) -> FrameChunk:
        """Return this chunk. Raises FormatError for NaN or infinity, with the frame and the vertex."""
        for name in ("positions", "normals", "tangents"):
            values = getattr(self, name)
            if values is not None and not arrays.is_finite(values):
                frame, vertex = (int(i) for i in np.argwhere(~np.isfinite(values))[0][:2])
                noun = "is" if name == "positions" else f"has {name}"
                raise FormatError(
                    f"vertex {vertex} {noun} beyond float32 (got {values[frame, vertex].tolist()})",
                    where=f"frame {self.first + frame}",
                )
        return self

    def __repr__(self) -> str:
        frames, vertices = self.positions.shape[:2]
        return f"FrameChunk(first={self.first}, frames={frames}, vertices={vertices})"


@dataclass(frozen=True, slots=True)
class MeshPart:
    """Vertices and faces of one primitive within a cache as half-open ranges, with its name.

    vertices: (first, last + 1) of V; faces: likewise of T. material: its index in the file, −1 for none.
    """

    name: str
    vertices: tuple[int, int]
    faces: tuple[int, int]
    node: int = -1
    material: int = -1


Chunks: TypeAlias = Callable[[], Iterator[FrameChunk]]


@dataclass(frozen=True, slots=True, eq=False)
class VertexCache:
    """F frames of V vertices in constant order, with triangles.

    times: (F,) s, increasing. faces: (T, 3). chunks: called for a new pass over all frames, in order, each frame once.
    rest: (V, 3) m, the rest mesh in the same order, or None. has_normals: whether every chunk has them.
    parts: the primitives, in order, covering all vertices; empty if unknown. up: "y" or "z". handedness: (V,) ±1
    if every chunk has tangents too, else None. chosen: description of the clip of the frames, if the file has
    others.
    """

    times: Floats
    vertex_count: int
    faces: Ints
    chunks: Chunks
    rest: Floats | None = None
    has_normals: bool = False
    parts: tuple[MeshPart, ...] = field(default=())
    up: str = "y"
    handedness: Floats | None = None
    chosen: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "times", arrays.as_key_times(self.times))
        arrays.check_shape(self.faces, "T 3", name="faces")
        if self.faces.size and not 0 <= int(self.faces.min()) <= int(self.faces.max()) < self.vertex_count:
            outside = int(self.faces.min() if self.faces.min() < 0 else self.faces.max())
            raise ShapeError(f"a face uses vertex {outside} of {self.vertex_count}")

    @property
    def frame_count(self) -> int:
        """Number of frames."""
        return len(self.times)

    @property
    def has_tangents(self) -> bool:
        """Return whether every chunk has tangents."""
        return self.handedness is not None

    def load_all(self) -> FrameChunk:
        """Return all frames at once: 12 bytes times F times V, so for short or small caches only."""
        chunks = list(self.chunks())
        positions = np.concatenate([each.positions for each in chunks])
        return FrameChunk(
            0, positions, _concatenate(each.normals for each in chunks), _concatenate(each.tangents for each in chunks)
        )

    def __repr__(self) -> str:
        span = f"start_s={self.times[0]:.6g}, end_s={self.times[-1]:.6g}" if len(self.times) else ""
        counts = f"frames={self.frame_count}, vertices={self.vertex_count}, faces={len(self.faces)}"
        return f"{type(self).__name__}({', '.join(filter(None, (counts, span)))})"


def from_arrays(
    times: Floats, positions: AnyArray, faces: Ints, *, normals: AnyArray | None = None, rest: Floats | None = None
) -> VertexCache:
    """Return a cache of frames in memory: positions and normals (F, V, 3), times (F,) s.

    Raises ShapeError for inconsistent shapes, RangeError for times that don't increase.
    from_arrays([0, 1], positions of shape (2, 4, 3), [[0, 1, 2]]) → a cache of 2 frames of 4 vertices
    """
    times = arrays.as_key_times(times)
    arrays.check_shape(np.asarray(positions), f"{len(times)} V 3", name="positions")
    if normals is not None:
        arrays.check_shape(np.asarray(normals), f"{len(times)} {positions.shape[1]} 3", name="normals")
    chunk = FrameChunk(
        0, np.asarray(positions, np.float32), None if normals is None else np.asarray(normals, np.float32)
    )
    return VertexCache(
        times, positions.shape[1], faces, lambda: iter((chunk,)), rest=rest, has_normals=normals is not None
    )


def _concatenate(parts: Iterable[AnyArray | None]) -> AnyArray | None:
    """All parts in one array, None if one is missing."""
    listed = list(parts)
    there = [each for each in listed if each is not None]
    return np.concatenate(there) if there and len(there) == len(listed) else None
