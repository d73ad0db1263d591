"""Findings of rules: a code and a name that stay the same, a severity, the part of the file, and advice."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple


class Severity(StrEnum):
    """Severity: invalid glTF, which players may refuse; a likely mistake; a waste or a remark."""

    ERROR = "error"
    WARNING = "warning"
    INFO = "info"

    def is_at_least(self, other: Severity) -> bool:
        """Return whether this is as severe as another one, or more."""
        order = list(Severity)  # most severe first
        return order.index(self) <= order.index(other)


@dataclass(frozen=True, slots=True)
class Occurrence:
    """One part of a file that breaks a rule.

    label: the part ("clip 'walk'"). pointer: its JSON pointer. count: number of faults in it. value: the largest of
    them, in the unit of the rule. problem: the observation, for rules whose `Rule.problem` does not write it.
    number: index of the part among its kind (clip, node, skin), name: its name. time_s, node: time and node of the
    largest or first fault in a clip, where it has one. is_fixable: False if the rule's fix leaves this one.
    """

    label: str
    pointer: str
    count: int = 1
    value: float = 0.0
    problem: str = ""
    advice: str = ""
    number: int = -1
    name: str = ""
    time_s: float | None = None
    node: int | None = None
    is_fixable: bool = True


class Finding(NamedTuple):
    """One finding.

    name: stable, in kebab-case. where: part of the file. problem: the observation. advice: the remedy.
    code: the rule's ("GA101"). pointer: JSON pointer of the (first) part. time_s: time of the largest fault, if it has
    one. fixable: "safe", "unsafe" or "".
    """

    name: str
    severity: Severity
    where: str
    problem: str
    advice: str
    code: str = ""
    pointer: str = ""
    time_s: float | None = None
    fixable: str = ""
