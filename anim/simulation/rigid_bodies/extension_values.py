"""Values of physics extensions in JSON, read with errors that name them."""

from __future__ import annotations

import math
from typing import Any

from anim.errors import AnimError, FormatError, RangeError
from anim.simulation.rigid_bodies.description import Vector


def as_fault(error: AnimError, where: str) -> AnimError:
    """Return the error of a faulty file at this position: a number out of range is one."""
    return (FormatError(error.problem, where=error.where) if isinstance(error, RangeError) else error).at(where)


def read_number(json: dict[str, Any], key: str, default: float) -> float:
    """Return a finite number. Raises FormatError for anything else."""
    if key not in json:
        return default
    return _number(json[key], key)


def read_numbers(json: dict[str, Any], key: str, count: int) -> tuple[float, ...] | None:
    """Return an array of `count` numbers, None without it. Raises FormatError for anything else."""
    values = json.get(key)
    if values is None:
        return None
    if not isinstance(values, list) or len(values) != count:
        raise FormatError(f"{key} is {values!r} (expected {count} numbers)")
    return tuple(_number(value, key) for value in values)


def read_vector(json: dict[str, Any], key: str) -> Vector | None:
    """Return an array of three numbers, None without it."""
    found = read_numbers(json, key, 3)
    return None if found is None else (found[0], found[1], found[2])


def read_texts(json: dict[str, Any], key: str) -> frozenset[str]:
    """Return an array of strings, empty without it. Raises FormatError for anything else."""
    values = json.get(key, [])
    if not isinstance(values, list) or not all(isinstance(value, str) for value in values):
        raise FormatError(f"{key} is {values!r} (expected strings)")
    return frozenset(values)


def read_axes(json: dict[str, Any], key: str) -> tuple[int, ...]:
    """Return an array of integers. Raises FormatError for anything else."""
    values = json.get(key)
    if not isinstance(values, list) or not all(type(value) is int for value in values):
        raise FormatError(f"{key} is {values!r} (expected some of 0, 1, 2)")
    return tuple(values)


def read_objects(json: dict[str, Any], key: str) -> list[dict[str, Any]]:
    """Return an array of objects, empty without it. Raises FormatError for anything else."""
    values = json.get(key, [])
    if not isinstance(values, list) or not all(isinstance(value, dict) for value in values):
        raise FormatError(f"{key} is {values!r} (expected a list of objects)")
    return values


def read_item(items: list[Any], index: Any, what: str) -> Any:
    """Return an item of a list by a file's index. Raises FormatError for one that doesn't exist."""
    if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < len(items):
        raise FormatError(f"there is no {what} {index!r} (the file has {len(items)})")
    return items[index]


def read_object(json: dict[str, Any], key: str) -> dict[str, Any]:
    """Return an object, empty without it. Raises FormatError for anything else."""
    value = json.get(key, {})
    if not isinstance(value, dict):
        raise FormatError(f"{key} is {value!r} (expected an object)")
    return value


def _number(value: Any, key: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FormatError(f"{key} is {value!r} (expected a number)")
    try:
        found = float(value)
    except OverflowError:  # an integer beyond float64
        found = math.inf
    if not math.isfinite(found):
        raise FormatError(f"{key} is beyond 1.8e308 (expected a finite number)")
    return found
