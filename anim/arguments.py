"""Checks of arguments of public functions."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Iterable, Sequence
from numbers import Integral
from typing import Any, TypeAlias

import numpy as np

from anim import units
from anim.errors import RangeError, ShapeError, check_number, in_one_line

Length: TypeAlias = str | float  # "0.5mm", "0.1%", or metres


def glob_list(globs: object, name: str) -> list[str]:
    """Return one glob or several as a list, empty for None, which selects all.

    Raises RangeError for an empty list, so that an empty result of the caller's doesn't select all; ShapeError for
    anything else.
    """
    if globs is None or isinstance(globs, str):
        return [] if globs is None else [globs]
    if not isinstance(globs, Iterable):
        raise ShapeError(f"{name} is {kind(globs)} (expected a glob such as 'run*', or a list of globs)")
    given = list(globs)
    if not given:
        raise RangeError(f"{name} is empty, which selects nothing", help=f"{name}=None selects all")
    result = [each for each in given if isinstance(each, str)]
    if len(result) < len(given):
        wrong = next(each for each in given if not isinstance(each, str))
        raise ShapeError(f"{name} has a value of type {kind(wrong)} (expected globs such as 'run*')")
    return result


def file_path(path: object, name: str = "path") -> str:
    """Return a path as text. Raises ShapeError for other types, RangeError for a null character."""
    if not isinstance(path, str | os.PathLike):
        raise ShapeError(f"{name} is {kind(path)} (expected a path)")
    text = os.fsdecode(path)
    if "\0" in text:
        raise RangeError(f"{name} is {text!r} (a path can't contain a null character)")
    return text


def check_function(value: object, name: str, expected: str) -> None:
    """Raise ShapeError unless `value` can be called."""
    if not callable(value):
        raise ShapeError(f"{name} is {kind(value)} (expected {expected})")


def check_binary_file(file: Any, name: str, method: str) -> None:
    """Raise ShapeError unless `file` is an open binary file with `method`, "read" or "write"."""
    expected, mode = ("reading", "rb") if method == "read" else ("writing", "wb")
    if not callable(getattr(file, method, None)):
        known = "a path, bytes or a binary file" if method == "read" else "a path or a binary file"
        raise ShapeError(f"{name} is {kind(file)} (expected {known})")
    if hasattr(file, "encoding"):
        raise ShapeError("file is open for text (expected a binary file)", help=f'open it with "{mode}"')
    if getattr(file, "closed", False) is True:
        raise ShapeError(f"file is closed (expected a file open for {expected})", help=f'open it with "{mode}"')
    is_allowed = getattr(file, "readable" if method == "read" else "writable", None)
    if callable(is_allowed) and not is_allowed():
        raise ShapeError(f"file is not open for {expected}", help=f'open it with "{mode}"')


def kind(value: object) -> str:
    """Return a value's type for messages: "None", "int"."""
    return "None" if value is None else type(value).__name__


def meters(value: str | float, name: str, scale: Callable[[], float], *, at_least: float | None = None) -> float:
    """Return metres from a number, or from text with a unit; `scale` is the length of 100 %, in metres.

    Raises RangeError below `at_least`, or if that is None, for 0 and less.
    """
    if isinstance(value, str) and units.is_zero(value):
        value = 0.0
    if isinstance(value, str):
        length = units.parse_length(value, name, scale)
        if not units.has_unit(value):
            text = value.strip()
            raise RangeError(f"{name} is '{text}', without a unit (expected '{text}mm' or '{text}m', say)")
        return length
    length = check_number(value, name)
    if not math.isfinite(length) or (length < at_least if at_least is not None else length <= 0):
        least = "above 0" if at_least is None else f"from {at_least:g}"
        raise RangeError(f"{name} is {value} (expected metres {least}, or a length like '0.5mm' or '0.1%')")
    return length


def radians(value: str | float, name: str) -> float:
    """Return an angle above 0 in radians from a number, or from text with a unit."""
    if isinstance(value, str):
        return units.parse_angle(value, name)
    angle = check_number(value, name)
    if not (math.isfinite(angle) and angle > 0):
        raise RangeError(f"{name} is {value} (expected radians above 0, or an angle like '0.5deg')")
    return angle


def positive(value: object, name: str) -> float:
    """Return a finite number above 0 as a float. Raises ShapeError or RangeError for others."""
    number = check_number(value, name)
    if not (math.isfinite(number) and number > 0):
        raise RangeError(f"`{name}` is {number:g} (expected a number above 0)")
    return number


def index(value: object, name: str) -> int:
    """Return a whole number as an int. Raises ShapeError for other types."""
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise ShapeError(f"`{name}` is {in_one_line(value)} (expected an index)")
    return int(value)


def check_flags(**flags: object) -> None:
    """Raise ShapeError unless all are True or False, of Python or numpy: "no" would count as true."""
    for name, value in flags.items():
        if not isinstance(value, bool | np.bool_):
            raise ShapeError(f"`{name}` is {in_one_line(value)} (expected True or False)")


def num_bytes(value: str | int, name: str) -> int:
    """Return a number of bytes above 0 from a whole number, or from text: "800kB". Raises ShapeError or RangeError."""
    if isinstance(value, str):
        return units.parse_size(value, name)
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise ShapeError(f"{name} is {kind(value)} (expected a number of bytes, or a size like '800kB')")
    if value < 1:
        raise RangeError(f"{name} is {value} (expected at least 1 byte, or a size like '800kB')")
    return min(int(value), sys.maxsize)


def check_workers(workers: object) -> None:
    """Raise ShapeError or RangeError unless `workers` is a number of processes."""
    if isinstance(workers, bool) or not isinstance(workers, Integral):
        raise ShapeError(f"workers is {kind(workers)} (expected a number of processes, 0 for one per core)")
    if workers < 0:
        raise RangeError(f"workers is {workers} (expected a number of processes, 0 for one per core)")


def check_choice(name: str, value: str, known: Sequence[str]) -> None:
    """Raise RangeError unless `value` is one of the known."""
    if value not in known:
        raise RangeError(f"{name} is '{value}' (expected {', '.join(known)})")
