"""Products of the matrix of points with columns of node matrices: dense, sparse, or of one joint per row, in blocks."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Floats, Ints

BLOCK = 500_000  # values per step of a product
BLOCK_ROWS = 64  # of a dense matrix, in blocks
MAX_USED_FRACTION = 0.7  # of its columns, in a block for which they are copied
NODE_BLOCK = 8192  # nodes whose matrices are stacked at once


class OneJointRows:
    """A sparse matrix (P, 4 J) with one joint per row, as of many nodes or rigid meshes.

    joints: (P,). factors: (P, 4), as of `PointMatrix`.
    """

    def __init__(self, joints: Ints, factors: NDArray[Any]) -> None:
        self._joints, self._factors = joints, factors

    def astype(self, kind: type[np.floating[Any]]) -> OneJointRows:
        """Return the same in another type."""
        return OneJointRows(self._joints, self._factors.astype(kind))

    def __matmul__(self, columns: NDArray[Any]) -> NDArray[Any]:
        """Return the product (P, C) with stacked columns (4 J, C), its terms added in order."""
        return np.concatenate([part._product(columns) for part in self.split(columns.shape[1])])

    def split(self, count: int) -> list[OneJointRows]:
        """Return the rows in blocks whose products with `count` columns take little memory."""
        step = max(BLOCK // max(count, 1), 1)
        starts = range(0, max(len(self._joints), 1), step)
        return [OneJointRows(self._joints[i : i + step], self._factors[i : i + step]) for i in starts]

    def _product(self, columns: NDArray[Any]) -> NDArray[Any]:
        first, factors = 4 * self._joints, self._factors[..., None]
        found: NDArray[Any] = factors[:, 0] * columns[first]
        for i in range(1, 4):
            found += factors[:, i] * columns[first + i]
        return found


class PointRows:
    """A matrix (P, 4 J), dense or sparse, as a factor of stacked columns."""

    def __init__(self, matrix: Any) -> None:
        self._matrix = matrix
        self._blocks = list(_dense_blocks(matrix)) if isinstance(matrix, np.ndarray) else []

    def blocks(self, columns: NDArray[Any]) -> Iterator[tuple[slice, Floats]]:
        """Yield displacements as `moves` does, in blocks of rows: points in the order of joints need few columns."""
        if not self._blocks:
            yield slice(None), self.moves(columns)
            return
        columns = columns.astype(np.float32, copy=False)
        for rows, used, matrix in self._blocks:
            yield rows, _moves(matrix, columns if used is None else columns[used])

    def moves(self, columns: NDArray[Any]) -> Floats:
        """Return displacements (P, 3, F) in float32 from differences of `stacked` matrices (4 J, 3 F)."""
        return _moves(self._matrix, columns.astype(np.float32, copy=False))

    def squares(self, columns: NDArray[Any]) -> Floats:
        """Return the squared lengths (P, F) of displacements, in the type of the columns, of many points in blocks."""
        parts = self._matrix.split(columns.shape[1]) if isinstance(self._matrix, OneJointRows) else [self._matrix]
        found = []
        for part in parts:
            moves = _moves(part, columns)
            moves *= moves
            found.append(moves.sum(axis=1))
        return np.concatenate(found)


def _dense_blocks(
    matrix: NDArray[np.float32],
) -> Iterator[tuple[slice, Ints | None, NDArray[np.float32]]]:
    """Rows of a dense matrix in blocks: their place, the columns that are not 0 (None: all), and these entries."""
    for first in range(0, len(matrix), BLOCK_ROWS):
        rows = slice(first, first + BLOCK_ROWS)
        used = np.flatnonzero(matrix[rows].any(axis=0))
        if len(used) > MAX_USED_FRACTION * matrix.shape[1]:
            yield rows, None, matrix[rows]
        else:
            yield rows, used, np.ascontiguousarray(matrix[rows][:, used])


def _moves(matrix: Any, columns: NDArray[Any]) -> Floats:
    moved = np.asarray(matrix @ columns)
    return moved.reshape(len(moved), 3, columns.shape[1] // 3)


def stack_points(world: Floats, nodes: Ints) -> Floats:
    """Return the columns of world matrices (N, F, 3, 4) of `nodes` as (4 J, 3 F): all x, all y, all z."""
    chosen = world[nodes]
    return chosen.transpose(0, 3, 2, 1).reshape(4 * len(nodes), 3 * world.shape[1])


def stack_blocks(
    matrices: Callable[[Ints], Floats], nodes: Ints, kind: type[np.floating[Any]]
) -> NDArray[np.floating[Any]]:
    """Return the same in a type, from a function that gives the matrices (J, F, 3, 4) of some nodes, in blocks."""
    blocks = [nodes[i : i + NODE_BLOCK] for i in range(0, max(len(nodes), 1), NODE_BLOCK)]
    stacked = (stack_points(matrices(each), np.arange(len(each))).astype(kind) for each in blocks)
    return np.concatenate(list(stacked))
