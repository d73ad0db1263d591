"""Numbers in a list that others refer to by number: freed ones are used again, and no other one moves."""

from __future__ import annotations

from collections.abc import Set

from anim.gltf.document import Json


class Slots:
    """Numbers for `count` new objects in a list: freed ones first, then beyond its end."""

    def __init__(self, length: int, freed: Set[int], count: int) -> None:
        ordered = sorted(freed)
        self.numbers = ordered[:count] + list(range(length, length + count - len(ordered)))
        self._holes = ordered[count:]

    def fill(self, objects: list[Json], new: list[Json], placeholder: Json) -> None:
        """Put new objects at their numbers, in place; what is left over goes, or becomes a placeholder."""
        for number, about in zip(self.numbers, new, strict=True):
            if number < len(objects):
                objects[number] = about
            else:
                objects.append(about)
        for number in reversed(self._holes):
            if number == len(objects) - 1:
                objects.pop()
            else:
                objects[number] = placeholder
