"""Checks of arguments for the functions of the facade."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

from anim.errors import RangeError, ShapeError


def glob_list(globs: object, name: str) -> list[str]:
    """Return one glob or several as a list, empty for None. Raises ShapeError for anything else."""
    if globs is None or isinstance(globs, str):
        return [] if globs is None else [globs]
    if not isinstance(globs, Iterable):
        raise ShapeError(f"{name} is {kind(globs)} (expected a glob such as 'run*', or a list of globs)")
    given = list(globs)
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
