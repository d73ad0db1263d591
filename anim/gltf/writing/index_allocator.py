"""Numbers in a list that others refer to by number: freed ones are used again, and no other one moves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from types import MappingProxyType

from anim.gltf.document import Json


class IndexAllocator:
    """Numbers for new objects in a list: freed ones first, then beyond its end.

    named: for each new object, how often its number will be written: the shortest numbers go to those named most.
    fixed: freed numbers that are given out already, by new object.
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
        """Put new objects at their numbers, in place; what is left over goes, or becomes a placeholder."""
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
