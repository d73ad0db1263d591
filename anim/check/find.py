"""Apply rules to a file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

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

    Costly rules are left out.
    """
    result: list[tuple[Finding, Sequence[Occurrence]]] = []
    for rule, found in occurrences(file, selection, costly=False):
        parts: Sequence[Sequence[Occurrence]] = [found] if rule.problem is not None else [[each] for each in found]
        result += ((rule.finding(part, file.facts.clips, selection.severity(rule)), part) for part in parts)
    return result


def occurrences(
    file: CheckedFile, selection: RuleSelection = DEFAULT, *, costly: bool = True
) -> Iterator[tuple[Rule, list[Occurrence]]]:
    """Yield each selected rule with its occurrences, if it has any."""
    for rule in selection.rules():
        if rule.is_costly and not costly:
            continue
        if found := list(rule.find(file, selection.values(rule))):
            yield rule, found
