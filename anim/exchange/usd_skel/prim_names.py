"""Names of prims: valid in USD, and different among siblings."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from anim.arrays import Ints
from anim.errors import UnsupportedError

MAX_PATH_CHARACTERS = 10_000_000


class PrimNames:
    """Names that are taken, by the path of the parent."""

    def __init__(self) -> None:
        self._taken: dict[str, UniqueNames] = {}

    def child(self, parent: str, name: str) -> str:
        """Return the path of a new child: child("/root", "left arm") → "/root/left_arm", then "/root/left_arm_2"."""
        return f"{parent}/{self._taken.setdefault(parent, UniqueNames()).add(valid(name))}"


class UniqueNames:
    """Names that differ, of which many may have been the same."""

    def __init__(self, names: Iterable[str] = ()) -> None:
        self._taken, self._last = set(names), dict[str, int]()

    def add(self, name: str) -> str:
        """Take and return the name, with a number if it is taken: add("arm") → "arm", then "arm_2"."""
        found, number = name, self._last.get(name, 1)
        while found in self._taken:
            number += 1
            found = f"{name}_{number}"
        self._taken.add(found)
        self._last[name] = number
        return found


def valid(name: str) -> str:
    """Return a name with underscores for characters that identifiers of USD lack, and before a first digit.

    valid("left arm") → left_arm; valid("2H_Sword") → _2H_Sword
    """
    from pxr import Tf

    given = f"_{name}" if name[:1].isdecimal() else name  # which would be replaced
    return str(Tf.MakeValidIdentifier(given.encode(errors="replace").decode()))


def joint_paths(names: Sequence[str], parents: Ints) -> list[str]:
    """Return the paths of joints (J,), parents before children: joint_paths(["hip", "leg"], [-1, 0]) → hip, hip/leg.

    Raises UnsupportedError where they are too long: each repeats the names of all joints above it.
    """
    known, found, length = PrimNames(), list[str](), 0
    for name, parent in zip(names, parents.tolist(), strict=True):
        path = known.child(found[parent] if parent >= 0 else "", name)
        found.append(path if parent >= 0 else path[1:])
        length += len(path)
        if length > MAX_PATH_CHARACTERS:
            raise UnsupportedError(
                f"the paths of {len(names)} joints take more than {MAX_PATH_CHARACTERS // 10**6} MB in USD: the joints "
                "hang too deep, or their names are too long"
            )
    return found
