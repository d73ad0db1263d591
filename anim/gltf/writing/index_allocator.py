"""Indices for new objects in a list: freed ones are reused, all others remain valid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from types import MappingProxyType

from anim.gltf.document import Json


class IndexAllocator:
    """Indices for new objects in a list: freed ones first, then appended ones.

    named: for each new object, its count of references: the shortest indices have the most references.
    fixed: freed indices that are already assigned, by new object.
    """

    def __init__(
        self, length: int, freed: Set[int], named: Sequence[int], *, fixed: Mapping[int, int] = MappingProxyType({})
    ) -> None:
        ordered, count = sorted(freed - set(fixed.values())), len(named) - len(fixed)
        taken = ordered[:count] + list(range(length, length + count - len(ordered)))
        self.numbers = [fixed.get(i, 0) for i in range(len(named))]
        others = (i for i in range(len(named)) if i not in fixed)
        for number, i in zip(taken, sorted(others, key=lambda i: -named[i]), strict=True):
            self.numbers[i] = number
        self._holes = ordered[count:]

    def fill(self, objects: list[Json], new: list[Json], placeholder: Json) -> None:
        """Store new objects at their indices, in place; remove unused ones or fill in a placeholder."""
        for number, about in sorted(zip(self.numbers, new, strict=True), key=lambda pair: pair[0]):
            if number < len(objects):
                objects[number] = about
            else:
                objects.append(about)
        for number in reversed(self._holes):
            if number == len(objects) - 1:
                objects.pop()
            else:
                objects[number] = placeholder
