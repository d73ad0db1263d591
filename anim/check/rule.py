"""A rule of `check` and `inspect`: what it finds, why it matters, and how to fix it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

from anim.check.advice import clip_advice
from anim.check.checked_file import CheckedFile
from anim.check.finding import Finding, Occurrence, Severity
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.measure.inspect.report import ClipReport
from anim.units import FEW, list_some

_NONE: Mapping[str, Any] = MappingProxyType({})


class Parameter(NamedTuple):
    """Number that a rule depends on. unit: "deg", "%", "s", "fps", "x" (a factor), or "" for a count."""

    default: float
    unit: str
    about: str


class TextParameter(NamedTuple):
    """Regular expression that a rule depends on. example: for messages."""

    default: str
    example: str
    about: str


class Parameters(dict[str, float]):
    """Numbers of a rule by name. texts: its regular expressions. target: the player of `--target`, "" for none."""

    def __init__(self, numbers: Mapping[str, float], texts: Mapping[str, str] = _NONE, target: str = "") -> None:
        super().__init__(numbers)
        self.texts = texts
        self.target = target


class Fix(NamedTuple):
    """Change of a document after which the rule finds nothing that is fixable.

    is_safe: no vertex moves by more than 1e-6 of the model's diagonal, which `fixing` measures on the written bytes.
    apply: returns the same document if nothing can be fixed. yields_to: codes of rules whose fixes it would undo; it
    is left out where they are selected.
    """

    about: str
    apply: Callable[[CheckedFile, Sequence[Occurrence], Parameters], Document]
    is_safe: bool
    yields_to: frozenset[str] = frozenset()


class Rule(NamedTuple):
    """One rule.

    code: stable; its first digit is the group. about: one line. why: evidence, and who is hurt. find: occurrences in a
    file. problem: text on several occurrences, which `inspect` lists as one finding; None: each has its own text.
    advice: the remedy, with {fps}, {finer}, {blend} and {clips} for a command on these clips (see
    `advice.clip_advice`), or "" if each occurrence has its own.
    is_default: False for rules that only `--select` turns on.
    is_costly: True for rules that sample whole clips; `inspect` leaves them to `check`, as it does the occurrences of
    `find_costly`.
    targets: severities for players named by `--target`. texts: parameters that are regular expressions.
    """

    code: str
    name: str
    severity: Severity
    about: str
    why: str
    find: Callable[[CheckedFile, Parameters], Iterable[Occurrence]]
    problem: Callable[[Sequence[Occurrence]], str] | None = None
    advice: str = ""
    fix: Fix | None = None
    parameters: Mapping[str, Parameter] = _NONE
    is_default: bool = True
    is_costly: bool = False
    find_costly: Callable[[CheckedFile, Parameters], Iterable[Occurrence]] | None = None
    targets: Mapping[str, Severity] = _NONE
    texts: Mapping[str, TextParameter] = _NONE

    def defaults(self, target: str = "") -> Parameters:
        """Return the default of each parameter."""
        numbers = {name: each.default for name, each in self.parameters.items()}
        return Parameters(numbers, {name: each.default for name, each in self.texts.items()}, target)

    def occurrences(self, file: CheckedFile, parameters: Parameters, *, costly: bool = True) -> list[Occurrence]:
        """Return the occurrences in a file; those of `find_costly` only if `costly`."""
        found = list(self.find(file, parameters))
        if costly and self.find_costly is not None:
            found += self.find_costly(file, parameters)
        return found

    def finding(self, found: Sequence[Occurrence], clips: Sequence[ClipReport], severity: Severity) -> Finding:
        """Return one finding for some occurrences (one or more). clips: of the file, for advice."""
        first = found[0]
        problem = first.problem if self.problem is None else self.problem(found)
        advice = first.advice or clip_advice(self.advice, clips, [each.number for each in found])
        where = first.label if len(found) == 1 else _labels(found)
        is_fixable = any(each.is_fixable for each in found)
        fixable = "" if self.fix is None or not is_fixable else ("safe" if self.fix.is_safe else "unsafe")
        return Finding(self.name, severity, where, problem, advice, self.code, first.pointer, first.time_s, fixable)


def _labels(found: Sequence[Occurrence]) -> str:
    """Label of several parts: "clips 'walk', #3, 'run' and 4 more"."""
    if all(each.label.startswith("clip ") and each.pointer.startswith("/animations/") for each in found):
        return reader.clip_labels([(each.name, each.number) for each in found])
    return list_some([each.label for each in found], FEW)


def counted(one: str, many: str) -> Callable[[Sequence[Occurrence]], str]:
    """Return a `Rule.problem` that writes the total count before a text in the singular or plural."""

    def problem(found: Sequence[Occurrence]) -> str:
        count = sum(each.count for each in found)
        return f"{count} {one if count == 1 else many}"

    return problem
