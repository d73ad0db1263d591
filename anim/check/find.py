"""Apply rules to a file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from operator import attrgetter

from anim.check.checked_file import CheckedFile
from anim.check.finding import Finding, Occurrence
from anim.check.rule import Rule
from anim.check.selection import RuleSelection

DEFAULT = RuleSelection()


def find_all(file: CheckedFile, selection: RuleSelection = DEFAULT) -> tuple[Finding, ...]:
    """Return one finding per occurrence, in the order of the rules."""
    return tuple(
        rule.finding([each], file.facts.clips, selection.severity(rule))
        for rule, found in occurrences(file, selection)
        for each in found
    )


def group_occurrences(
    file: CheckedFile, selection: RuleSelection = DEFAULT
) -> list[tuple[Finding, Sequence[Occurrence]]]:
    """Return one finding per rule that can sum up occurrences, else per occurrence, each with its occurrences.

    Occurrences with advice of their own are summed up with those of the same advice only. Costly rules are left out.
    """
    result: list[tuple[Finding, Sequence[Occurrence]]] = []
    for rule, found in occurrences(file, selection, costly=False):
        parts = [[each] for each in found] if rule.problem is None else _by_advice(found)
        result += ((rule.finding(part, file.facts.clips, selection.severity(rule)), part) for part in parts)
    return result


def _by_advice(found: Sequence[Occurrence]) -> list[list[Occurrence]]:
    advice = attrgetter("advice")
    return [list(some) for _, some in groupby(sorted(found, key=advice), advice)]


def occurrences(
    file: CheckedFile, selection: RuleSelection = DEFAULT, *, costly: bool = True
) -> Iterator[tuple[Rule, list[Occurrence]]]:
    """Yield each selected rule with its occurrences, if it has any."""
    for rule in selection.rules():
        if rule.is_costly and not costly:
            continue
        if found := rule.occurrences(file, selection.values(rule), costly=costly):
            yield rule, found
