"""Messages on stderr, and formatting of numbers with units."""

from __future__ import annotations

import sys
from contextlib import suppress

from anim.units import MIN_EXPONENT_VALUE, format_number
from cli.streams import step_streams
from cli.tables import quote

MAX_LINE_LENGTH = 1000  # characters of a message: names in a file can have any length
MIN_PERCENT = 1e-4
DRY = " (dry run: nothing written)"
MIN_LENGTH_M = 1e-11  # m; smaller lengths come from rounding


class Reporter:
    """Writer of messages by verbosity: errors and warnings only, one line, or all details.

    warnings: issued so far, for the list of this name in a JSON report.
    """

    def __init__(self, quiet: bool = False, verbose: bool = False) -> None:
        self.quiet = quiet
        self.verbose = verbose
        self.warnings: list[str] = []

    def info(self, line: str) -> None:
        """Write a line to stderr unless quiet: cut if very long, and one line whatever names of a file contain."""
        if not self.quiet:
            self._write(quote(line, MAX_LINE_LENGTH))

    def _write(self, line: str) -> None:
        if (step := step_streams()) is not None:
            step.messages.append(line)
            return
        with suppress(OSError, AttributeError):  # stderr is closed
            sys.stderr.write(line + "\n")

    def warn(self, words: str) -> None:
        """Write "warning: words" to stderr once, even when quiet: facts that change the meaning of a figure."""
        if words not in self.warnings:
            self.warnings.append(words)
            Reporter().info(f"warning: {words}")

    def verbose_info(self, line: str) -> None:
        """Write a line to stderr if details are requested."""
        if self.verbose:
            self.info(line)


def format_bytes(count: int) -> str:
    """Return a size with its unit: "812 B", "42.3 kB", "3.66 MB"."""
    if count < 1000:
        return f"{count} B"
    for unit in ("kB", "MB", "GB"):
        count_in_unit = count / 1000 ** (("kB", "MB", "GB").index(unit) + 1)
        if count_in_unit < 999.5 or unit == "GB":
            return f"{count_in_unit:.3g} {unit}" if count_in_unit < 100 else f"{count_in_unit:.0f} {unit}"
    raise AssertionError


def format_change(before: int, after: int) -> str:
    """Return "42.3 kB → 9.1 kB (-78 %)", without a percentage that rounds to 0."""
    percent = round(100 * (after - before) / before) if before else 0
    return f"{format_bytes(before)} → {format_bytes(after)}" + (f" ({percent:+d} %)" if percent else "")


def format_length(meters: float) -> str:
    """Return a length in a suitable unit: "0.41 mm", "12 µm", "1.5 cm", "2.9 m"."""
    if meters == 0:
        return "0 mm"
    if meters < MIN_LENGTH_M:
        return f"<{format_number(1e9 * MIN_LENGTH_M, 2)} nm"
    for unit, factor, limit in (("nm", 1e9, 1e-6), ("µm", 1e6, 1e-4), ("mm", 1e3, 1e-2), ("cm", 1e2, 1.0)):
        if float(f"{meters:.2g}") < limit:
            return f"{format_number(meters * factor, 2)} {unit}"
    return f"{format_number(meters, 3)} m"


def format_step_error(meters: float) -> str:
    """Return words for the error estimate of a simulation: "a run with half the step differs by up to 2 mm"."""
    return f"a run with half the step differs by up to {format_length(meters)}"


def format_fraction(part: float, whole: float) -> str:
    """Return " (0.41 %)", or "" if the whole is 0 or the fraction is negligible."""
    percent = 100 * part / whole if whole else 0.0
    return f" ({format_number(percent, 2)} %)" if percent >= MIN_PERCENT else ""


def format_speed(meters_per_second: float) -> str:
    """Return a speed with two digits: "0.46 m/s", "280 m/s"."""
    return f"{format_number(meters_per_second, 2)} m/s"


def format_time(seconds: float) -> str:
    """Return a time or duration rounded to 0.1 ms: "0.0417 s", "12 s"."""
    return f"{_round_significant(seconds)} s"


def format_instant(seconds: float) -> str:
    """Return a time in a clip rounded to 1 ms, also of a late clip: "0.267 s", "5001.8 s"."""
    return f"{_without_zeros(seconds, 3)} s"


def format_span(start: float, end: float) -> str:
    """Return the time span of a clip: "1.5 s", or "0.0417–2 s" if it starts after 0."""
    begins = _round_significant(start)
    return format_time(end) if begins == "0" else f"{begins}–{format_time(end)}"


def _round_significant(seconds: float) -> str:
    return _without_zeros(seconds, 4)


def _without_zeros(value: float, decimals: int) -> str:
    """The value with up to so many decimals, or an exponent where these have no meaning."""
    if abs(value) >= MIN_EXPONENT_VALUE:
        return f"{value:.4g}"
    return f"{value:.{decimals}f}".rstrip("0").rstrip(".")


def format_duration(seconds: float) -> str:
    """Return the run time of the command, marked to differ from a clip's duration: "took 0.8 s"."""
    return f"took {format_number(seconds, 2 if seconds < 10 else 3)} s"
