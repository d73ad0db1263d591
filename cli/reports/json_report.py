"""JSON of reports: UTF-8 text, in which every number is finite."""

from __future__ import annotations

import io
import json
import math
import operator
from collections.abc import Iterator

from anim.errors import FormatError

MAX_INDENTED_VALUES = 200_000


def dump(content: object, *, indent: int | None = 1) -> str:
    """Return a report as a JSON document that ends with a line break. Raises FormatError for NaN and infinity.

    Without an indent, or of more than MAX_INDENTED_VALUES, it has a single line: the encoder that indents takes several
    times as long, and what is that long is read by programs.
    A function in the content stands for what it returns when its turn comes: reports of 100 000 clips are then not all
    in memory as JSON values beside the text.
    """
    try:
        if indent is None or _is_long(content):
            return json.dumps(content, allow_nan=False, ensure_ascii=indent is None, default=operator.call) + "\n"
        text = io.StringIO()  # piece by piece: a list of all pieces takes several times the memory of the text
        json.dump(content, text, allow_nan=False, ensure_ascii=False, indent=indent, default=operator.call)
    except ValueError:
        check_finite(content)
        raise
    text.write("\n")
    return text.getvalue()


def _is_long(content: object) -> bool:
    """Return whether a report has more than MAX_INDENTED_VALUES values, those of lists and objects."""
    waiting, count = [content], 0
    while waiting and count <= MAX_INDENTED_VALUES:
        value = waiting.pop()
        if callable(value):
            value = value()
        inside = value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ()
        count += len(inside)
        waiting += [each for each in inside if isinstance(each, dict | list | tuple) or callable(each)]
    return count > MAX_INDENTED_VALUES


def check_finite(content: object) -> None:
    """Raise FormatError, with the path of the number, if a report contains NaN or infinity."""
    for where, value in _not_finite(content, ""):
        raise FormatError(
            f"{where} is {value}: no report of it is possible",
            help="values of the file, or products of them, are too large",
        )


def _not_finite(value: object, path: str) -> Iterator[tuple[str, float]]:
    """Yield paths and values of the numbers that JSON has no form for."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _not_finite(item, f"{path}.{key}" if path else str(key))
    elif isinstance(value, list | tuple):
        for i, item in enumerate(value):
            yield from _not_finite(item, f"{path}[{i}]")
    elif callable(value):
        yield from _not_finite(value(), path)
    elif isinstance(value, float) and not math.isfinite(value):
        yield path, value
