"""Rules for JSON values: checks that raise FormatError with the position as a path."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

from anim.errors import FormatError

Check: TypeAlias = Callable[[Any], None]
MAX_NUMBER = 3.4e38  # near float32's maximum


class ObjectRule:
    """Rule for an object: a check per property, required properties, and a check of the object."""

    def __init__(
        self, properties: Mapping[str, Check], required: tuple[str, ...] = (), whole: Check | None = None
    ) -> None:
        self.properties = properties
        self.required = required
        self.whole = whole

    def __call__(self, value: Any) -> None:
        if type(value) is not dict:
            raise FormatError(f"is {_name(value)} (expected an object)")
        for key in self.required:
            if key not in value:
                raise FormatError(f"has no '{key}'")
        properties = self.properties
        for key, item in value.items():
            check = properties.get(key)
            if check is not None:
                try:
                    check(item)
                except FormatError as error:
                    raise error.at(key, _join_path(error)) from None
        if self.whole is not None:
            self.whole(value)


def check_property(key: str, rule: Check, value: Any) -> None:
    """Check the value of a property; errors include its name."""
    try:
        rule(value)
    except FormatError as error:
        raise error.at(key, _join_path(error)) from None


def check_items(values: list[Any], rule: Check, key: str) -> None:
    """Check every value of an array; errors include its index."""
    i = 0
    try:
        for i, value in enumerate(values):  # noqa: B007 (i is read after the loop broke)
            rule(value)
    except FormatError as error:
        raise error.at(f"{key}[{i}]", _join_path(error)) from None


def _join_path(error: FormatError) -> str:
    return "" if error.where.startswith("[") else "." if error.where else ""


def list_of(rule: Check) -> Check:
    """Return a check for an array of values that pass a rule."""

    def check_list(value: Any) -> None:
        of_type(value, list, "an array")
        check_items(value, rule, "")

    return check_list


def map_of(rule: Check) -> Check:
    """Return a check for an object of any keys with values that pass a rule."""

    def check_map(value: Any) -> None:
        of_type(value, dict, "an object")
        for key, item in value.items():
            check_property(key, rule, item)

    return check_map


def index(of: str, count: int) -> Check:
    """Return a check for an index into `count` objects."""

    def check_index(value: Any) -> None:
        if type(value) is not int or not 0 <= value < count:
            of_type(value, int, "a whole number")
            raise FormatError(f"is {value} (the file has {count} {of})")

    return check_index


def at_least(least: int) -> Check:
    """Return a check for a whole number ≥ `least`."""

    def check_whole(value: Any) -> None:
        if type(value) is not int or value < least:
            of_type(value, int, "a whole number")
            raise FormatError(f"is {value} (expected {least} or more)")

    return check_whole


def one_of(*allowed: int) -> Check:
    """Return a check for one of a few whole numbers."""

    def check_one(value: Any) -> None:
        if type(value) is not int or value not in allowed:
            raise FormatError(f"is {_name(value)} (expected one of {', '.join(map(str, allowed))})")

    return check_one


def numbers(count: int | None) -> Check:
    """Return a check for an array of finite numbers, of length `count` unless None."""

    def check_numbers(value: Any) -> None:
        of_type(value, list, "an array")
        if count is not None and len(value) != count:
            raise FormatError(f"has {len(value)} numbers (expected {count})")
        for item in value:
            if (type(item) is not float and type(item) is not int) or not -MAX_NUMBER < item < MAX_NUMBER:
                raise FormatError(f"holds {_name(item)} (expected finite numbers)")

    return check_numbers


def number(value: Any) -> None:
    """Check a finite number."""
    if (type(value) is not float and type(value) is not int) or not -MAX_NUMBER < value < MAX_NUMBER:
        raise FormatError(f"is {_name(value)} (expected a finite number)")


def text(value: Any) -> None:
    """Check a string."""
    if type(value) is not str:
        of_type(value, str, "a string")


def boolean(value: Any) -> None:
    """Check a truth value."""
    of_type(value, bool, "true or false")


def of_type(value: Any, kind: type, words: str, where: str = "") -> None:
    """Check the type of a value. words: the expected type."""
    if type(value) is not kind:
        raise FormatError(f"is {_name(value)} (expected {words})", where=where)


def _name(value: Any) -> str:
    words = {dict: "an object", list: "an array", str: "a string", bool: "a boolean", type(None): "null"}
    return words.get(type(value), repr(value)[:60])
