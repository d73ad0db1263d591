"""The order in which the contents of one stream compress best: each begins near where the one before it ends.

meshopt's codec stores by how much each byte of an element differs from the one before, 16 elements at a time, so what
an order costs shows where one content follows another, and exactly only in the compressed bytes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats, Ints
from anim.gltf.meshopt import codec

STARTS = 8  # contents that a chain is begun with, in turn
COMPARED = 500_000  # pairs of contents for all of these chains together, but for the first
# Of a byte that differs by 0, ±1, … from the one before: about the bytes that it takes (none, 2 bits, 4 bits, a byte).
PRICES = np.select([np.arange(256) == 0, np.arange(256) < 3, np.arange(256) < 15], [0.0, 0.3, 0.8], 1.3)


def ordered(codes: Sequence[bytes], stride: int, extension: str) -> list[int]:
    """Return the numbers of contents in the order that takes fewest bytes among those tried; always the same one.

    codes: of each content, elements of `stride` bytes, the last filled up. extension: whose codec it is.
    """
    stream = _Stream(codes, stride, extension)
    count = len(codes)
    starts = range(min(count, max(1, min(STARTS, COMPARED // count**2))))
    orders = [list(range(count)), *(stream.chain(start) for start in starts)]
    return min(orders, key=stream.size)


class _Stream:
    """Contents, and what any order of them costs."""

    def __init__(self, codes: Sequence[bytes], stride: int, extension: str) -> None:
        self._stride = stride
        self._extension = extension
        self._rows = [np.frombuffer(each, np.uint8).reshape(-1, stride) for each in codes]

    def size(self, order: Sequence[int]) -> int:
        """Return the bytes of an order when compressed."""
        return len(codec.encode(np.concatenate([self._rows[i] for i in order]), self._extension))

    def chain(self, start: int) -> list[int]:
        """Return the order that goes from each content to the one that begins most like it ends."""
        firsts = np.array([rows[0] for rows in self._rows])
        lasts = np.array([rows[-1] for rows in self._rows])
        left = np.arange(len(firsts))
        order = [start]
        while len(left) > 1:
            left = left[left != order[-1]]
            order.append(int(left[_apart(firsts[left], lasts[order[-1]]).argmin()]))
        return order


def _apart(firsts: Ints, last: Ints) -> Floats:
    """What elements (n, stride) cost after the element `last` (stride,)."""
    steps = (firsts - last).view(np.int8).astype(np.int64)
    return np.asarray(PRICES[np.where(steps >= 0, 2 * steps, -2 * steps - 1)].sum(axis=1))
