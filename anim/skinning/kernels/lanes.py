"""What kernels are given: vertices, what they hang on, room to work in, and where results go."""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Ints

Singles: TypeAlias = NDArray[np.float32]

LANES = 32  # frames that a kernel takes at a time; a constant, so that the compiler sees what lies where
TILE = 32  # vertices between two transpositions to frame-major order
LINE = 64  # bytes that memory hands out together: rows that start there are read a third faster


class Shape(NamedTuple):
    """Vertices in mesh space for up to LANES frames, frames innermost, float32.

    points: (V, 3, m) m, m = 1 where no frame differs, else LANES. normals, tangents: the same, (0, 3, 1) where not
    wanted.
    """

    points: Singles
    normals: Singles
    tangents: Singles


class Held(NamedTuple):
    """Influences start[v] … start[v + 1] of vertex v, strongest first: weight (E,) and joint (E,); start (V + 1,)."""

    weight: Singles
    joint: NDArray[np.int32]
    start: Ints


class Target(NamedTuple):
    """Where the results of n frames go: columns `at` … `at` + V of positions (n, all, 3).

    normals, tangents: the same, or (0, 0, 3) where not wanted.
    """

    at: int
    positions: Singles
    normals: Singles
    tangents: Singles


class Room(NamedTuple):
    """Where a kernel works; what is in it doesn't matter before or after.

    points, normals, tangents: (TILE, 3, L), results in frames-innermost order. turns (8, L), matrix, stretch (12, L),
    center (3, L): of one vertex. shares: (I, L), of its influences in each frame.
    """

    points: Singles
    normals: Singles
    tangents: Singles
    turns: Singles
    matrix: Singles
    stretch: Singles
    center: Singles
    shares: Singles


def room(influences: int) -> Room:
    """Return room for vertices with up to so many influences."""
    rows = aligned(9 * TILE + 35 + influences, LANES)
    points, normals, tangents = rows[: 9 * TILE].reshape(3, TILE, 3, LANES)
    rest = rows[9 * TILE :]
    return Room(points, normals, tangents, rest[:8], rest[8:20], rest[20:32], rest[32:35], rest[35:])


def aligned(*shape: int) -> Singles:
    """Return an array (shape) with anything in it that starts at a cache line."""
    size = math.prod(shape)
    memory: Singles = np.empty(size + LINE // 4, np.float32)
    first = -memory.ctypes.data % LINE // 4
    return memory[first : first + size].reshape(shape)


NOTHING: Singles = np.empty((0, 0, 3), np.float32)  # the normals or tangents of a Target that wants none
