"""Members of a JSON object, checked as they are read; errors name them: "position.scale[1] is 'x' (expected …)"."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any

from anim.errors import FormatError

MAX_SHOWN = 40  # characters of a value


class Members:
    """An object of a JSON. path: of the object, with a dot after it, or empty."""

    def __init__(self, content: dict[str, Any], path: str = "") -> None:
        self._content = content
        self._path = path

    def text(self, key: str, choices: Collection[str] = (), *, default: str | None = None) -> str:
        """Return a text; one of `choices`, if there are any."""
        value = self._get(key, default)
        if not isinstance(value, str) or (choices and value not in choices):
            raise self._wrong(key, value, " or ".join(f"'{each}'" for each in choices) or "text")
        return value

    def count(self, key: str, least: int, *, default: int | None = None) -> int:
        """Return a whole number."""
        value = self._get(key, default)
        if not _is_number(value) or value != int(value) or value < least:
            raise self._wrong(key, value, f"a whole number, {least} or more")
        return int(value)

    def number(self, key: str) -> float:
        """Return a number above 0."""
        value = self._get(key)
        if not _is_number(value) or not value > 0:
            raise self._wrong(key, value, "a number above 0")
        return float(value)

    def numbers(self, key: str, length: int | None = None) -> tuple[float, ...]:
        """Return a list of numbers, of a length or any but 0."""
        values = self._get(key)
        if not isinstance(values, list) or not values or len(values) != (length or len(values)):
            raise self._wrong(key, values, f"{length or 'one or more'} numbers")
        for i, value in enumerate(values):
            if not _is_number(value):
                raise self._wrong(f"{key}[{i}]", value, "a number")
        return tuple(float(value) for value in values)

    def child(self, key: str) -> Members:
        """Return a member that is an object."""
        value = self._get(key)
        if not isinstance(value, dict):
            raise self._wrong(key, value, "an object")
        return Members(value, f"{self._path}{key}.")

    def is_set(self, key: str) -> bool:
        """Return whether a member is there and not null."""
        return self._content.get(key) is not None

    def _get(self, key: str, default: object = None) -> Any:
        if key not in self._content and default is None:
            raise FormatError(f"has no member '{self._path}{key}'")
        return self._content.get(key, default)

    def _wrong(self, key: str, value: object, expected: str) -> FormatError:
        shown = repr(value)
        shown = shown if len(shown) <= MAX_SHOWN else f"{shown[:MAX_SHOWN]}…"
        return FormatError(f"{self._path}{key} is {shown} (expected {expected})")


def _is_number(value: object) -> bool:
    """Return whether it is a finite number of float64; True and False are none."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False
