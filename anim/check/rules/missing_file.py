"""GA021: images that are not there."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the files."""
    for label, pointer, problem in file.missing:
        yield Occurrence(label, pointer, problem=problem)


RULE = Rule(
    "GA021",
    "missing-file",
    Severity.WARNING,
    "An image that the file names is not there.",
    "Players show the model without it, or not at all.",
    find,
    advice="put it there, or fix the URI",
)
