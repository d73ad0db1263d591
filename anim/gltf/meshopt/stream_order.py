"""Order of the contents of one stream that compresses best: similar end and start values adjoin.

meshopt's codec stores byte differences between consecutive elements, 16 elements at a time. So the cost of an order
arises where one content follows another; only the compressed bytes give it exactly.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats, Ints
from anim.gltf.meshopt import codec

MAX_CHAINS = 8  # contents tried as the first of a chain
MAX_COMPARED_PAIRS = 500_000  # pairs of contents compared for all of these chains together, except the first
# Approximate bytes per byte difference of 0, ±1, … (none, 2 bits, 4 bits, a byte).
PRICES = np.select([np.arange(256) == 0, np.arange(256) < 3, np.arange(256) < 15], [0.0, 0.3, 0.8], 1.3)


def order_contents(codes: Sequence[bytes], stride: int, extension: str) -> list[int]:
    """Return content indices in the smallest of the tried orders, deterministically.

    codes: of each content, elements of `stride` bytes, the last one padded. extension: the codec's.
    """
    stream = _Stream(codes, stride, extension)
    count = len(codes)
    starts = range(min(count, max(1, min(MAX_CHAINS, MAX_COMPARED_PAIRS // count**2))))
    orders = [list(range(count)), *(stream.chain(start) for start in starts)]
    return min(orders, key=stream.size)


class _Stream:
    """Contents, and the cost of any order."""

    def __init__(self, codes: Sequence[bytes], stride: int, extension: str) -> None:
        self._stride = stride
        self._extension = extension
        self._rows = [np.frombuffer(each, np.uint8).reshape(-1, stride) for each in codes]

    def size(self, order: Sequence[int]) -> int:
        """Return the compressed bytes of an order."""
        return len(codec.encode(np.concatenate([self._rows[i] for i in order]), self._extension))

    def chain(self, start: int) -> list[int]:
        """Return the order by greedy nearest neighbour: each content's start is closest to the previous end."""
        firsts = np.array([rows[0] for rows in self._rows])
        lasts = np.array([rows[-1] for rows in self._rows])
        left = np.arange(len(firsts))
        order = [start]
        while len(left) > 1:
            left = left[left != order[-1]]
            order.append(int(left[_step_costs(firsts[left], lasts[order[-1]]).argmin()]))
        return order


def _step_costs(firsts: Ints, last: Ints) -> Floats:
    """Cost of elements (n, stride) after the element `last` (stride,)."""
    steps = (firsts - last).view(np.int8).astype(np.int64)
    return np.asarray(PRICES[np.where(steps >= 0, 2 * steps, -2 * steps - 1)].sum(axis=1))
