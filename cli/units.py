"""Option values with units; invalid ones raise UsageError."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

from anim import units
from anim.errors import RangeError
from cli.errors import UsageError


def parse_fraction(text: str, option: str) -> float:
    """Return a fraction above 0: "0.1%" or a number without unit. Raises UsageError otherwise."""
    with _usage_errors():
        return units.parse_fraction(text, option)


def parse_length(text: str, option: str, diagonal: Callable[[], float]) -> float:
    """Return a length above 0 in metres, also from "0.1%" of `diagonal()`. Raises UsageError otherwise."""
    with _usage_errors():
        return units.parse_length(text, option, diagonal)


def warn_without_unit(text: str | None, option: str, warn: Callable[[str], None]) -> None:
    """Warn of a bound without a unit, which is in metres: --max-error 1 was likely meant as something smaller."""
    given = (text or "").strip()
    if given[-1:].isdigit() and not units.is_zero(given):
        warn(f"{option} {given} means {given} m, for want of a unit (0.5mm, 0.1%)")


def parse_bound(text: str, option: str, diagonal: Callable[[], float], warn: Callable[[str], None]) -> float:
    """Return a bound in metres as `parse_length` does; one without a unit is warned of."""
    warn_without_unit(text, option, warn)
    return parse_length(text, option, diagonal)


def parse_angle(text: str, option: str) -> float:
    """Return an angle above 0 in radians from "0.05deg" or "0.001rad". Raises UsageError otherwise."""
    with _usage_errors():
        return units.parse_angle(text, option)


def parse_size(text: str, option: str) -> int:
    """Return a number of bytes above 0 from "800kB", "1.5MB" or "65536". Raises UsageError otherwise."""
    with _usage_errors():
        return units.parse_size(text, option)


SYNTAX: Mapping[str, Callable[[str, str], object]] = {  # by metavar; 0 is the command's to refuse
    "LENGTH": lambda text, option: units.is_zero(text) or units.parse_length(text, option, lambda: 1.0),
    "ANGLE": lambda text, option: units.is_zero_angle(text) or units.parse_angle(text, option),
    "FRACTION": lambda text, option: units.is_zero(text) or units.parse_fraction(text, option),
    "SIZE": units.parse_size,
}


def check_syntax(metavar: str, text: str, option: str) -> None:
    """Raise UsageError for a value that no model makes valid, before any file is read.

    metavar: of the option, such as LENGTH; others than in `SYNTAX` have no units.
    """
    if metavar in SYNTAX:
        with _usage_errors():
            SYNTAX[metavar](text, option)


@contextmanager
def _usage_errors() -> Iterator[None]:
    try:
        yield
    except RangeError as error:
        raise UsageError(error.problem) from None
