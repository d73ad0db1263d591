"""Rules for JSON values: checks that raise FormatError with the position as a path."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from typing import Any, TypeAlias

from anim.errors import FormatError

Check: TypeAlias = Callable[[Any], None]
MAX_NUMBER = 3.4e38  # near float32's maximum
MIN_COLUMN = 16  # values; fewer are checked one by one


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

    def passes(self, values: Sequence[Any]) -> bool:
        """Return True if all values pass, by property: in half the time of the checks one by one."""
        if not set(map(type, values)) <= {dict}:
            return False
        try:
            columns = [(key, list(map(operator.itemgetter(key), values))) for key in self.required]
        except KeyError:
            return False
        optional = self.properties.keys() - self.required
        columns += [(key, [value[key] for value in values if key in value]) for key in optional]
        if not all(_pass(self.properties.get(key), column) for key, column in columns if column):
            return False
        return self.whole is None or _none_refused(self.whole, values)


def _none_refused(check: Check, values: Sequence[Any]) -> bool:
    try:
        for value in values:
            check(value)
    except FormatError:
        return False
    return True


class ListRule:
    """Rule for an array of values that pass a rule."""

    def __init__(self, rule: Check) -> None:
        self.rule = rule

    def __call__(self, value: Any) -> None:
        of_type(value, list, "an array")
        check_items(value, self.rule, "")

    def passes(self, values: Sequence[Any]) -> bool:
        """Return True if all of one or more arrays pass: their values together, not array by array."""
        if set(map(type, values)) != {list}:
            return False
        together = list(chain.from_iterable(values))
        return not together or _pass(self.rule, together)


class MapRule:
    """Rule for an object of any keys with values that pass a rule."""

    def __init__(self, rule: Check) -> None:
        self.rule = rule

    def __call__(self, value: Any) -> None:
        of_type(value, dict, "an object")
        for key, item in value.items():
            check_property(key, self.rule, item)

    def passes(self, values: Sequence[Any]) -> bool:
        """Return True if all of one or more objects pass: their values together, not object by object."""
        if set(map(type, values)) != {dict}:
            return False
        together = list(chain.from_iterable([value.values() for value in values]))
        return not together or _pass(self.rule, together)


class Numbers:
    """Rule for an array of finite numbers, of length `count` unless None."""

    def __init__(self, count: int | None) -> None:
        self.count = count

    def __call__(self, value: Any) -> None:
        of_type(value, list, "an array")
        if self.count is not None and len(value) != self.count:
            raise FormatError(f"has {len(value)} numbers (expected {self.count})")
        for item in value:
            if (type(item) is not float and type(item) is not int) or not -MAX_NUMBER < item < MAX_NUMBER:
                raise FormatError(f"holds {_name(item)} (expected finite numbers)")

    def passes(self, values: Sequence[Any]) -> bool:
        """Return whether all of one or more arrays pass."""
        if set(map(type, values)) != {list} or (self.count is not None and set(map(len, values)) != {self.count}):
            return False
        together = list(chain.from_iterable(values))
        if not set(map(type, together)) <= {int, float}:
            return False
        return all(-MAX_NUMBER < item < MAX_NUMBER for item in together)  # min and max pass over NaN


class WholeNumber:
    """Rule for a whole number from `least` on, below `end`. words: for others, after "is 7 "."""

    def __init__(self, least: int, end: float, words: str) -> None:
        self.least = least
        self.end = end
        self.words = words

    def __call__(self, value: Any) -> None:
        if type(value) is not int or not self.least <= value < self.end:
            of_type(value, int, "a whole number")
            raise FormatError(f"is {value} ({self.words})")

    def passes(self, values: Sequence[Any]) -> bool:
        """Return whether all of one or more values pass."""
        return set(map(type, values)) == {int} and self.least <= min(values) and max(values) < self.end


class OneOf:
    """Rule for one of a few whole numbers."""

    def __init__(self, allowed: tuple[int, ...]) -> None:
        self.allowed = allowed

    def __call__(self, value: Any) -> None:
        if type(value) is not int or value not in self.allowed:
            raise FormatError(f"is {_name(value)} (expected one of {', '.join(map(str, self.allowed))})")

    def passes(self, values: Sequence[Any]) -> bool:
        """Return whether all of one or more values pass."""
        return set(map(type, values)) == {int} and set(values).issubset(self.allowed)


class OfType:
    """Rule for a value of one type. words: the type."""

    def __init__(self, kind: type, words: str) -> None:
        self.kind = kind
        self.words = words

    def __call__(self, value: Any) -> None:
        of_type(value, self.kind, self.words)

    def passes(self, values: Sequence[Any]) -> bool:
        """Return whether all of one or more values pass."""
        return set(map(type, values)) == {self.kind}


Columnwise = (
    ObjectRule | ListRule | MapRule | Numbers | WholeNumber | OneOf | OfType
)  # rules that check many values at once
text = OfType(str, "a string")
boolean = OfType(bool, "true or false")


def _pass(rule: Check | None, values: Sequence[Any]) -> bool:
    """Return True if all of one or more values pass, False if some may not."""
    return rule is None or (isinstance(rule, Columnwise) and rule.passes(values))


def check_property(key: str, rule: Check, value: Any) -> None:
    """Check the value of a property; errors include its name."""
    try:
        rule(value)
    except FormatError as error:
        raise error.at(key, _join_path(error)) from None


def check_items(values: list[Any], rule: Check, key: str) -> None:
    """Check every value of an array; errors include its index."""
    if len(values) >= MIN_COLUMN and _pass(rule, values):
        return
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

    return ListRule(rule)


def map_of(rule: Check) -> Check:
    """Return a check for an object of any keys with values that pass a rule."""

    return MapRule(rule)


def index(of: str, count: int) -> Check:
    """Return a check for an index into `count` objects."""

    return WholeNumber(0, count, f"the file has {count} {of}")


def at_least(least: int) -> Check:
    """Return a check for a whole number ≥ `least`."""

    return WholeNumber(least, math.inf, f"expected {least} or more")


def one_of(*allowed: int) -> Check:
    """Return a check for one of a few whole numbers."""

    return OneOf(allowed)


def numbers(count: int | None) -> Check:
    """Return a check for an array of finite numbers, of length `count` unless None."""

    return Numbers(count)


def number(value: Any) -> None:
    """Check a finite number."""
    if (type(value) is not float and type(value) is not int) or not -MAX_NUMBER < value < MAX_NUMBER:
        raise FormatError(f"is {_name(value)} (expected a finite number)")


def of_type(value: Any, kind: type, words: str, where: str = "") -> None:
    """Check the type of a value. words: the expected type."""
    if type(value) is not kind:
        raise FormatError(f"is {_name(value)} (expected {words})", where=where)


def _name(value: Any) -> str:
    words = {dict: "an object", list: "an array", str: "a string", bool: "a boolean", type(None): "null"}
    return words.get(type(value), repr(value)[:60])
