"""GA010: input that other commands refuse."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.errors import AnimError

MAX_LISTED_FAULTS = 10  # maximum number of listed faults of a file


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the faults of a file."""
    yield from fault_occurrences(file.facts.faults)


def fault_occurrences(faults: Sequence[AnimError]) -> Iterator[Occurrence]:
    """Yield the first faults for which other commands refuse a file."""
    for fault in faults[:MAX_LISTED_FAULTS]:
        advice = fault.help or "fix it where the file is made; other commands refuse it"
        yield Occurrence(fault.where or "file", "", problem=fault.problem, advice=advice)
    if len(faults) > MAX_LISTED_FAULTS:
        problem = f"{len(faults) - MAX_LISTED_FAULTS} more faults"
        yield Occurrence("file", "", problem=problem, advice="fix the first ones, and inspect again")


RULE = Rule(
    "GA010",
    "invalid",
    Severity.ERROR,
    "The file is not valid glTF, or not of a kind that other commands read.",
    "Players refuse such files, or show a part of them. `check` continues with what can be read, and exits with 3.",
    find,
)
