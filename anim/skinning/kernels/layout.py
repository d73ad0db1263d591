"""Arguments of kernels: vertices, their influences, and output arrays."""

from __future__ import annotations

import math
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Ints

FloatArray: TypeAlias = NDArray[np.float32]
OptionalArray: TypeAlias = Any  # FloatArray, or None: a kernel is compiled without it

GROUP = 4  # influences per step of `weighted_sum`; vertices with fewer get some of weight 0
LANES = 32  # frames per kernel step; a constant, so that the compiler knows the strides
TILE = 32  # vertices between two transpositions to frame-major order
CACHE_LINE_BYTES = 64  # rows aligned to it are read a third faster


class VertexBlock(NamedTuple):
    """Vertices in mesh space for up to LANES frames, frames innermost, float32.

    points: (V, 3, m) m; m = 1 if all frames are equal, else LANES. normals, tangents: the same, (0, 3, 1) if not
    requested.
    """

    points: FloatArray
    normals: FloatArray
    tangents: FloatArray


class Influences(NamedTuple):
    """Influences start[v] … start[v + 1] of vertex v, strongest first: weight (E,), joint (E,).

    start: (V + 1,). max_count: largest number of influences of a vertex.
    """

    weight: FloatArray
    joint: NDArray[np.int32]
    start: Ints
    max_count: int


class OutputSlice(NamedTuple):
    """Output columns `at` … `at` + V of positions (n, all, 3) for n frames.

    normals, tangents: the same, or (0, 0, 3) if not requested.
    """

    at: int
    positions: FloatArray
    normals: FloatArray
    tangents: FloatArray


class ScaleShear(NamedTuple):
    """Transforms before rotation: matrices (J, 15, L), a scale-shear (12, L) and the joint's position.

    scales: (J, 1, L). scale_influences: influences of the scales on that of a vertex.
    """

    matrices: FloatArray
    scales: FloatArray
    scale_influences: Influences


def vertices(shape: VertexBlock) -> tuple[FloatArray, OptionalArray, OptionalArray]:
    """Return points, normals and tangents; None if not requested, as kernels are compiled without them."""
    return shape.points, _or_none(shape.normals), _or_none(shape.tangents)


def output(target: OutputSlice) -> tuple[int, tuple[FloatArray, OptionalArray, OptionalArray]]:
    """Return the first column and the arrays of a target; None if not requested."""
    return target.at, (target.positions, _or_none(target.normals), _or_none(target.tangents))


def aligned(*shape: int) -> FloatArray:
    """Return an uninitialized array (shape), aligned to a cache line."""
    size = math.prod(shape)
    memory: FloatArray = np.empty(size + CACHE_LINE_BYTES // 4, np.float32)
    first = -memory.ctypes.data % CACHE_LINE_BYTES // 4
    return memory[first : first + size].reshape(shape)


def group_influences(influences: Influences) -> Influences:
    """Return the same influences, padded per vertex to a multiple of GROUP by its first joint.

    The padding has weight 0.
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


NO_OUTPUT: FloatArray = np.empty((0, 0, 3), np.float32)  # normals or tangents of an OutputSlice without them
