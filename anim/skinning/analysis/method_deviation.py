"""Deviation of a method from linear blending, the result in every player."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from anim.arrays import AnyArray, Floats
from anim.model import Clip, FrameChunk
from anim.skinning.bake import Baker, prepare_bake


class Deviation(NamedTuple):
    """Largest distance (m) of a vertex from its position by linear blending, and its time (s).

    size: m, of the model.
    """

    distance: float
    time: float
    size: float


def linear_baker(made: Baker, *, space: str) -> Baker:
    """Return a baker of the same meshes by linear blending, positions only. space: that of `made`."""
    nodes = sorted({each.node for each in made.instances})
    return prepare_bake(made.scene, space=space, rigid=True, nodes=nodes, threads=made.threads)


class MeasuredBake:
    """A bake whose first complete pass over its frames measures its deviation from linear blending too.

    made, linear: bakers of the same meshes. times: (F,) s. progress: as by `Baker.bake`.
    """

    def __init__(
        self,
        made: Baker,
        linear: Baker,
        clip: Clip,
        times: Floats,
        progress: Callable[[int], None] = lambda frames: None,
    ) -> None:
        self._own = made.bake(clip, times=times, progress=progress)
        self._linear = linear.bake(clip, times=times)
        self._size = model_size(made)
        self._found: Deviation | None = None
        self.cache = replace(self._own, chunks=self._chunks)

    def deviation(self) -> Deviation:
        """Return the deviation; the frames are baked for it if no pass was complete."""
        if self._found is None:
            for _ in self._chunks():
                pass
        assert self._found is not None
        return self._found

    def _chunks(self) -> Iterator[FrameChunk]:
        if self._found is not None:
            yield from self._own.chunks()
            return
        most = Deviation(0.0, 0.0, self._size)
        for chunk, linear in zip(self._own.chunks(), self._linear.chunks(), strict=True):
            found = max_distance(chunk.positions, linear.positions)
            at = int(found.argmax())
            most = max(most, Deviation(float(found[at]), float(self._own.times[chunk.first + at]), self._size))
            yield chunk
        self._found = most


def max_distance(positions: AnyArray, others: AnyArray) -> Floats:
    """Return the largest distance (F,) in each frame between positions and others (F, V, 3)."""
    with np.errstate(over="ignore", invalid="ignore"):
        apart = positions - others
        squares = np.einsum("fvi,fvi->fv", apart, apart).max(axis=1, initial=0.0)
    if not np.isfinite(squares).all() and positions.dtype != np.float64:  # float32 has no squares of 1e20 m
        return max_distance(positions.astype(np.float64), others.astype(np.float64))
    return np.asarray(np.sqrt(squares), float)


def model_size(made: Baker) -> float:
    """Return the diagonal in metres of the vertices' bounding box at rest; infinity for an extent of 0."""
    return float(np.linalg.norm(np.ptp(made.rest, axis=0))) or np.inf
