"""Principal components of all frames under a bound on the maximum vertex error."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from anim.arrays import AnyArray, Floats
from anim.memory import MemoryBudget

BLOCK_VALUES = 1 << 22  # values processed at a time, in float64
MIN_EIGENVALUE_FRACTION = 1e-15  # fraction of the largest eigenvalue; smaller ones are noise


@dataclass(frozen=True, slots=True)
class PcaBasis:
    """base (V, 3), shapes (k, V, 3), both float32, weights (F, k): frame f is base + Σ weights[f] shapes."""

    base: AnyArray
    shapes: AnyArray
    weights: Floats


def fit_basis(positions: AnyArray, limit: float, *, most: int) -> PcaBasis | None:
    """Return the fewest shapes within `limit` m for every vertex of every frame; None above `most`.

    positions: (F, V, 3). Computed from the F×F products of frames, with half of float64's digits: sufficient for limits
    above 1e-6 of the extent. Each shape's maximum displacement is 1 m, for integer storage. Memory: the products, the
    shapes and a block of vertices. Raises UnsupportedError for products above the limit of memory.
    """
    MemoryBudget(0).check(8 * len(positions) ** 2)
    products = np.zeros((len(positions), len(positions)))
    for _, rows, _ in _blocks(positions):
        products += rows @ rows.T
    values, vectors = np.linalg.eigh(products)
    rank = int(np.count_nonzero(values > values.max() * MIN_EIGENVALUE_FRACTION))
    vectors = vectors[:, ::-1][:, : min(rank, most)]
    count = _min_shapes(positions, vectors, limit)
    if count is None:
        return None
    vectors = vectors[:, :count]
    base = np.empty(positions.shape[1:], np.float32)
    shapes = np.empty((count, *positions.shape[1:]), np.float32)
    for some, rows, mean in _blocks(positions):
        base[some] = mean.reshape(-1, 3)
        shapes[:, some] = (vectors.T @ rows).reshape(count, rows.shape[1] // 3, 3)
    size = np.abs(shapes).max(axis=(1, 2), initial=0.0).astype(np.float64)
    size = np.where(size > 0, size, 1.0) * np.where(shapes.sum(axis=(1, 2), dtype=np.float64) < 0, -1, 1)
    shapes /= size[:, None, None].astype(np.float32)
    return PcaBasis(base, shapes, vectors * size)


def _blocks(positions: AnyArray) -> Iterator[tuple[slice, Floats, Floats]]:
    """Blocks of vertices, minus their mean over the frames (F, 3 n), and that mean (3 n)."""
    step = max(BLOCK_VALUES // (3 * len(positions)), 1)
    for first in range(0, positions.shape[1], step):
        some = slice(first, first + step)
        rows = positions[:, some].reshape(len(positions), -1).astype(np.float64)
        mean = rows.mean(axis=0)
        yield some, rows - mean, mean


def _min_shapes(positions: AnyArray, vectors: Floats, limit: float) -> int | None:
    low, high = 0, int(vectors.shape[1])
    if not _fits(positions, vectors, limit):
        return None
    while low < high:
        middle = (low + high) // 2
        if _fits(positions, vectors[:, :middle], limit):
            high = middle
        else:
            low = middle + 1
    return high


def _fits(positions: AnyArray, vectors: Floats, limit: float) -> bool:
    """True if these columns (F, k) reproduce every vertex within the limit."""
    for _, rows, _ in _blocks(positions):
        off = (rows - vectors @ (vectors.T @ rows)).reshape(-1, 3)
        if float(np.einsum("vi,vi->v", off, off).max(initial=0.0)) > limit * limit:
            return False
    return True
