"""Names with arguments, "spring(100, 10)": text form of easings and tangent rules."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Generic, TypeVar

from anim.errors import RangeError

T = TypeVar("T")

CALL = re.compile(r"\s*([A-Za-z][\w -]*?)\s*(?:\(([^()]*)\))?\s*")
WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+|\d+")
SUGGESTIONS = 3


@dataclass(frozen=True, slots=True)
class Factory(Generic[T]):
    """A name with arguments: its usage, and the factory function of the argument texts.

    examples: calls such as "back-out(3)" that tests evaluate.
    """

    usage: str
    make: Callable[[tuple[str, ...]], T]
    examples: tuple[str, ...] = ()


def parse_call(text: str, ready: Mapping[str, T], makers: Mapping[str, Factory[T]], *, kind: str, listing: str) -> T:
    """Return the entry of `ready` that `text` names, or one made by `makers` from its arguments.

    kind: type of the entries for messages, such as "easing". listing: the table of names, for the help.
    Case and spaces around names and arguments are ignored.
    Raises RangeError for an unknown name, with the nearest ones, and for wrong arguments, with the usage.
    parse_call("back-out(3)", ...) → makers["back-out"].make(("3",))
    """
    call = CALL.fullmatch(text)
    if call is None:
        raise RangeError(f"can't read {kind} {text!r} (expected a name or name(number, ...))")
    name, inside = call[1].lower(), call[2]
    if inside is None and name in ready:
        return ready[name]
    if name not in makers:
        if name in ready:
            raise RangeError(f"{kind} '{name}' takes no arguments (got {inside!r})")
        raise RangeError(
            f"unknown {kind} {call[1]!r}{_suggestion(call[1], [*ready, *makers])}", help=f"see `{listing}`"
        )
    maker = makers[name]
    if inside is None:
        raise RangeError(f"{kind} '{name}' requires arguments", help=f"write {maker.usage}")
    try:
        return maker.make(tuple(part.strip() for part in inside.split(",")) if inside.strip() else ())
    except RangeError as error:
        raise error.advise(f"write {maker.usage}").at(f"{kind} {text!r}", separator="") from None


def numbers(arguments: tuple[str, ...], count: int) -> tuple[float, ...]:
    """Return the arguments as `count` floats, also from fractions as 1/3. Raises RangeError otherwise."""
    if len(arguments) != count:
        raise RangeError(f"number of arguments is {len(arguments)} (expected {count})")
    return tuple(number(argument) for argument in arguments)


def number(text: str) -> float:
    """Return the float of a text: "0.25", "-1e-3" or "1/3". Raises RangeError otherwise."""
    above, slash, below = text.partition("/")
    try:
        return float(above) / float(below) if slash else float(above)
    except (ValueError, ZeroDivisionError):
        raise RangeError(f"{text!r} is not a number") from None


def _suggestion(name: str, known: list[str]) -> str:
    """Return "did you mean ...?": names of the same words in any order (easeInOutQuad), or near spellings."""
    words = {word.lower() for word in WORD.findall(name)}
    same = [k for k in known if words in (set(k.split("-")), set(k.split("-")) | {"ease"})]
    family = [k for k in known if k.startswith(f"{name.lower()}-")]
    near = get_close_matches(name.lower(), known, n=SUGGESTIONS, cutoff=0.5)
    found = dict.fromkeys(same or (*family, *near))
    if not found:
        return ""
    return f" (did you mean {' or '.join(repr(k) for k in [*found][:SUGGESTIONS])}?)"
