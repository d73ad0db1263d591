"""Names of outputs with places for other names: one file per clip from '{clip}.npz', per mesh from '{mesh}.npz'."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from cli.errors import UsageError

FORBIDDEN = frozenset('/\\:*?"<>|')  # what some file system doesn't take in a name
_PLACEHOLDER = re.compile(r"\{([A-Za-z_]\w*)\}")


def check_placeholders(output: str, known: Sequence[str] = ()) -> None:
    """Raise UsageError where a name of an output has a place, like {foo}, that nothing would be put into."""
    for name in _PLACEHOLDER.findall(output):
        if name not in known:
            expected = " or ".join(f"{{{each}}}" for each in known)
            raise UsageError(
                f"{output}: {{{name}}} stands for nothing (expected {expected or 'a name without { }'})",
                help="" if known else "only bake writes a file per {clip} and {mesh}",
            )


def expand(output: str, rows: Sequence[Mapping[str, str]], numbers: Sequence[int]) -> list[str]:
    """Return a file name for each row, its values in the places that are called as their keys.

    A value without a usable letter becomes the number of its row, and a name that is taken gets that number.
    expand("{clip}.npz", [{"clip": "walk"}, {"clip": "Walk"}], [0, 3]) → ["walk.npz", "Walk-3.npz"]
    """
    names: list[str] = []
    taken: set[str] = set()  # to some file systems "Walk" and "walk" are one name
    for row, number in zip(rows, numbers, strict=True):
        values = {key: _plain(value) or str(number) for key, value in row.items()}
        last = next((key for key in reversed(values) if f"{{{key}}}" in output), "")
        while (file := _filled(output, values)).casefold() in taken and last:
            values[last] += f"-{number}"
        names.append(file)
        taken.add(file.casefold())
    return names


def _filled(output: str, values: Mapping[str, str]) -> str:
    return _PLACEHOLDER.sub(lambda match: values.get(match[1], match[0]), output)


def _plain(name: str) -> str:
    return "".join("_" if c in FORBIDDEN or not c.isprintable() else c for c in name).strip(". ")
