"""JSON text with one value a line, as `json.dump(…, indent=n)` writes it, mostly by json's compiled encoder.

With `indent` json encodes in Python, piece by piece, which takes several times as long. The compiled encoder takes any
separator: one with a line break and spaces writes the items of a container in which no other one is.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from itertools import groupby
from typing import Any


class IndentedJson:
    """Writer by a function of text. indent: spaces per depth. Raises ValueError for NaN and infinity."""

    def __init__(self, write: Callable[[str], object], indent: int) -> None:
        self._write, self._indent = write, indent
        self._encoders: list[Callable[[object], str]] = []  # by depth of the items

    def value(self, content: object, depth: int = 0) -> None:
        """Write a value at a depth: neighbors without items of their own together, others one by one."""
        if _is_single(content):
            self._write(self._encoder(0)(content))
            return
        is_object = isinstance(content, dict)
        items: Iterable[Any] = content.items() if isinstance(content, dict) else content  # type: ignore[assignment]
        line = "\n" + " " * self._indent * (depth + 1)
        start = ("{" if is_object else "[") + line
        for is_single, run in groupby(items, lambda item: _is_single(item[1] if is_object else item)):
            own = list(run)
            if is_single:  # as one container without its brackets
                self._write(start + self._encoder(depth + 1)(dict(own) if is_object else own)[1:-1])
                start = "," + line
                continue
            for item in own:
                key, inner = (self._encoder(0)({item[0]: 0})[1:-2], item[1]) if is_object else ("", item)
                self._write(start + key)
                self.value(inner, depth + 1)
                start = "," + line
        self._write("\n" + " " * self._indent * depth + ("}" if is_object else "]"))

    def _encoder(self, depth: int) -> Callable[[object], str]:
        while len(self._encoders) <= depth:
            separators = (",\n" + " " * self._indent * len(self._encoders), ": ")
            self._encoders.append(json.JSONEncoder(ensure_ascii=False, allow_nan=False, separators=separators).encode)
        return self._encoders[depth]


def _is_single(value: object) -> bool:
    """Return True for a value on one line: none with items."""
    return not (value and isinstance(value, dict | list | tuple))
