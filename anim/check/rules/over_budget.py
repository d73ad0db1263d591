"""GA402: files above a limit of their budget."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.budget import ERROR, measure_budget
from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule

OPTIMIZE = "make it smaller where it is made, with `optimize`, or change the limit"
CHANGE = "change the file where it is made, or the limit"
ADVICE = {
    **dict.fromkeys(("bytes", "animation_bytes", "keys", "keys_per_second"), OPTIMIZE),
    ERROR: "make it with smaller errors in all of its steps, or change the limit",
}
MAX_PRECISE_RATIO = 1.01  # of the limit: above, no fractions of a percent
MIN_TIMES_RATIO = 10.0  # of the limit: from here on "12 times", not "1200 %"


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the limits that are exceeded."""
    for name, value, limit in measure_budget(file):
        if value > limit:
            unit = " m" if name == ERROR else ""
            share = f" ({_share(value / limit)})" if limit else ""
            place = f" in {file.budget_place}" if file.budget_place else ""
            problem = f"{value:.6g}{unit}, above the limit of {limit:.6g}{unit}{share}{place}"
            yield Occurrence(name, "", value=value, problem=problem, advice=ADVICE.get(name, CHANGE), name=name)


def _share(ratio: float) -> str:
    """A value as a part of its limit: "100.2 %", "134 %", "5837 times"."""
    if ratio >= MIN_TIMES_RATIO:
        return f"{ratio:.4g} times"
    return f"{100 * ratio:.1f} %" if ratio < MAX_PRECISE_RATIO else f"{100 * ratio:.0f} %"


RULE = Rule(
    "GA402",
    "over-budget",
    Severity.ERROR,
    "The file exceeds a limit of [[budget]] in the settings.",
    "Budgets keep downloads and memory of all files of a kind within what was agreed.",
    find,
    advice=CHANGE,
)
