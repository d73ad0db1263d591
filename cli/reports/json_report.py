"""JSON of reports: UTF-8 text, in which every number is finite."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Iterator

from anim.errors import FormatError


def dump(content: object, *, indent: int | None = 1) -> str:
    """Return a report as a JSON document that ends with a line break. Raises FormatError for NaN and infinity."""
    text = io.StringIO()
    try:
        if indent is None:
            text.write(json.dumps(content, allow_nan=False))
        else:  # piece by piece: a list of all pieces takes several times the memory of the text
            json.dump(content, text, allow_nan=False, ensure_ascii=False, indent=indent)
    except ValueError:
        check_finite(content)
        raise
    text.write("\n")
    return text.getvalue()


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
    elif isinstance(value, float) and not math.isfinite(value):
        yield path, value
