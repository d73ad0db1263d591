"""Values of physics extensions in JSON, read with errors that name them."""

from __future__ import annotations

from typing import Any

from anim.errors import AnimError, FormatError, RangeError
from anim.simulation.rigid_bodies.description import Vector


def as_fault(error: AnimError, where: str) -> AnimError:
    """Return the error of a faulty file at this position: a number out of range is one."""
    return (FormatError(error.problem, where=error.where) if isinstance(error, RangeError) else error).at(where)


def read_number(json: dict[str, Any], key: str, default: float) -> float:
    """Return a finite number. Raises FormatError for anything else."""
    value = json.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FormatError(f"{key} is {value!r} (expected a number)")
    return float(value)


def read_numbers(json: dict[str, Any], key: str, count: int) -> tuple[float, ...] | None:
    """Return an array of `count` numbers, None without it. Raises FormatError for anything else."""
    values = json.get(key)
    if values is None:
        return None
    numbers = [value for value in values if isinstance(value, int | float)] if isinstance(values, list) else []
    if len(numbers) != count or len(values) != count:
        raise FormatError(f"{key} is {values!r} (expected {count} numbers)")
    return tuple(float(value) for value in numbers)


def read_vector(json: dict[str, Any], key: str) -> Vector | None:
    """Return an array of three numbers, None without it."""
    found = read_numbers(json, key, 3)
    return None if found is None else (found[0], found[1], found[2])


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
