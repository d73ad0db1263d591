"""GA402: files above a limit of their budget."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.budget import ERROR, measure_budget
from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the limits that are exceeded."""
    for name, value, limit in measure_budget(file):
        if value > limit:
            unit = " m" if name == ERROR else ""
            share = f" ({100 * value / limit:.0f} %)" if limit else ""
            place = f" in {file.budget_place}" if file.budget_place else ""
            problem = f"{value:.6g}{unit}, above the limit of {limit:.6g}{unit}{share}{place}"
            yield Occurrence(name, "", value=value, problem=problem, name=name)


RULE = Rule(
    "GA402",
    "over-budget",
    Severity.ERROR,
    "The file exceeds a limit of [[budget]] in the settings.",
    "Budgets keep downloads and memory of all files of a kind within what was agreed.",
    find,
    advice="make it smaller where it is made, with `optimize`, or change the limit",
)
