"""What kernels are given: vertices, their influences, and where results go."""

from __future__ import annotations

import math
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Ints

FloatArray: TypeAlias = NDArray[np.float32]
OptionalArray: TypeAlias = Any  # Singles, or None where it is not wanted: a kernel is compiled without it

GROUP = 4  # influences that `weighted_sum` takes at a time; vertices with fewer get some of weight 0
LANES = 32  # frames that a kernel takes at a time; a constant, so that the compiler sees what lies where
TILE = 32  # vertices between two transpositions to frame-major order
CACHE_LINE_BYTES = 64  # bytes that memory hands out together: rows that start there are read a third faster


class VertexBlock(NamedTuple):
    """Vertices in mesh space for up to LANES frames, frames innermost, float32.

    points: (V, 3, m) m, m = 1 where no frame differs, else LANES. normals, tangents: the same, (0, 3, 1) where not
    wanted.
    """

    points: FloatArray
    normals: FloatArray
    tangents: FloatArray


class Influences(NamedTuple):
    """Influences start[v] … start[v + 1] of vertex v, strongest first: weight (E,) and joint (E,); start (V + 1,).

    most: how many a vertex has at most.
    """

    weight: FloatArray
    joint: NDArray[np.int32]
    start: Ints
    max_count: int


class OutputSlice(NamedTuple):
    """Where the results of n frames go: columns `at` … `at` + V of positions (n, all, 3).

    normals, tangents: the same, or (0, 0, 3) where not wanted.
    """

    at: int
    positions: FloatArray
    normals: FloatArray
    tangents: FloatArray


class ScaleShear(NamedTuple):
    """What points go through before they are rotated: matrices (J, 15, L), a stretch (12, L) and the joint's place.

    scales: (J, 1, L). ruling: influences by which scales make up the one of a vertex.
    """

    matrices: FloatArray
    scales: FloatArray
    ruling: Influences


def vertices(shape: VertexBlock) -> tuple[FloatArray, OptionalArray, OptionalArray]:
    """Return points, normals and tangents, None for those that are not wanted: kernels are compiled without them."""
    return shape.points, _or_none(shape.normals), _or_none(shape.tangents)


def output(target: OutputSlice) -> tuple[int, tuple[FloatArray, OptionalArray, OptionalArray]]:
    """Return the first column and the arrays of a target, None for those that are not wanted."""
    return target.at, (target.positions, _or_none(target.normals), _or_none(target.tangents))


def aligned(*shape: int) -> FloatArray:
    """Return an array (shape) with anything in it that starts at a cache line."""
    size = math.prod(shape)
    memory: FloatArray = np.empty(size + CACHE_LINE_BYTES // 4, np.float32)
    first = -memory.ctypes.data % CACHE_LINE_BYTES // 4
    return memory[first : first + size].reshape(shape)


def group_influences(influences: Influences) -> Influences:
    """Return the same influences, the last GROUP of each vertex filled up by its first joint with weight 0.

    group_influences([0.7, 0.3], [4, 7], start [0, 2]) → [0.7, 0.3, 0, 0], [4, 7, 4, 4], start [0, 4]
    """
    counts = np.diff(influences.start)
    start = np.concatenate(([0], np.cumsum(-(-counts // GROUP) * GROUP)))
    owner = np.repeat(np.arange(len(counts)), np.diff(start))
    k = np.arange(start[-1]) - start[owner]
    is_own = k < counts[owner]
    source = influences.start[owner] + np.where(is_own, k, 0)
    weight = np.where(is_own, influences.weight[source], np.float32(0))
    return Influences(weight, influences.joint[source], start, -(-influences.max_count // GROUP) * GROUP)


def _or_none(values: FloatArray) -> FloatArray | None:
    return values if len(values) else None


NOTHING: FloatArray = np.empty((0, 0, 3), np.float32)  # the normals or tangents of a Target that wants none
