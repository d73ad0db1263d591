"""Memory that is used again: fresh pages cost more than filling them (2 to 1, measured)."""

from __future__ import annotations

import math
from threading import Lock
from weakref import ref

import numpy as np

from anim.arrays import AnyArray
from anim.skinning.kernels.lanes import Singles


class Buffers:
    """Gives arrays of float32 with anything in them; what nobody holds any more, nor a view of it, is given again."""

    def __init__(self) -> None:
        self._lent: list[tuple[memoryview, ref[AnyArray]]] = []
        self._one_at_a_time = Lock()

    def array(self, *shape: int) -> Singles:
        """Return an array (shape) that is nobody else's."""
        size = math.prod(shape)
        with self._one_at_a_time:
            for i, (memory, last) in enumerate(self._lent):
                if last() is None and len(memory) >= size:
                    del self._lent[i]
                    return self._lend(memory, shape, size)
            return self._lend(np.empty(size, np.float32).data, shape, size)

    def _lend(self, memory: memoryview, shape: tuple[int, ...], size: int) -> Singles:
        """Views keep the first array on the memory alive, not the memory alone, so that one weak reference tells."""
        array: Singles = np.frombuffer(memory, np.float32, size)
        self._lent.append((memory, ref(array)))
        return array.reshape(shape)
