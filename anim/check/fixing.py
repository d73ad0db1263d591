"""Fixes of rules, each measured on the written bytes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence
from anim.check.influence_error import influence_error
from anim.check.rule import Rule
from anim.check.selection import RuleSelection
from anim.errors import AnimError, UnsupportedError
from anim.gltf.document import Document
from anim.gltf.io import container
from anim.measure.continuous_bound.largest_error import largest_error
from anim.measure.continuous_bound.prover import Prover
from anim.measure.error.metric import ErrorMetric
from anim.measure.inspect.contents import read_contents
from anim.measure.inspect.inspect import inspect
from anim.model import Clip

MAX_SAFE_ERROR_PER_DIAGONAL = 1e-6
MAX_PASSES = 4  # over all rules: a fix can make room for another one, as a key at 0 s that is redundant then
REST = Clip("", ())


@dataclass(frozen=True, slots=True)
class AppliedFix:
    """A fix that was applied. count: occurrences. error_m: largest error of a vertex, in m."""

    rule: Rule
    count: int
    error_m: float


class RefusedFix(NamedTuple):
    """A fix that was left out: for its error in m, or for a problem of the file."""

    rule: Rule
    error_m: float
    problem: str = ""


class FixResult(NamedTuple):
    """The fixed document, the fixes in it, and those left out."""

    document: Document
    applied: tuple[AppliedFix, ...]
    refused: tuple[RefusedFix, ...]


def fix_all(file: CheckedFile, selection: RuleSelection, *, unsafe: bool) -> FixResult:
    """Return the document after the fixes of the selected rules. unsafe: also those that may change the motion.

    Each fix is written, read again and compared with the document before; all safe ones together move no vertex by
    more than 1e-6 of the diagonal: one that would is left out. Rules are applied again until none of them finds
    anything to fix. Files with faults are not fixed.
    """
    fixer = _Fixer(file, selection, unsafe)
    if not file.facts.faults:
        for _ in range(MAX_PASSES):
            if not fixer.run():
                break
    return FixResult(fixer.file.document, tuple(fixer.applied.values()), tuple(fixer.refused.values()))


@dataclass
class _Fixer:
    """Applies fixes to a file. safe_error: sum of the errors of its safe fixes, in m."""

    file: CheckedFile
    selection: RuleSelection
    unsafe: bool
    applied: dict[str, AppliedFix] = field(default_factory=dict)
    refused: dict[str, RefusedFix] = field(default_factory=dict)
    safe_error: float = 0.0

    def run(self) -> bool:
        """Apply each fix once; return whether the file changed."""
        before = self.file.document
        for rule in self._rules():
            found = [each for each in rule.occurrences(self.file, self.selection.values(rule)) if each.is_fixable]
            if found:
                try:
                    self._apply(rule, found)
                except AnimError as error:
                    self.refused[rule.code] = RefusedFix(rule, 0.0, str(error))
        return self.file.document is not before

    def _rules(self) -> Iterator[Rule]:
        for rule in self.selection.rules():
            if rule.fix is not None and rule.code not in self.refused and (rule.fix.is_safe or self.unsafe):
                yield rule

    def _apply(self, rule: Rule, found: list[Occurrence]) -> None:
        assert rule.fix is not None
        if others := rule.fix.yields_to & {each.code for each in self.selection.rules()}:
            raise UnsupportedError(f"that would undo the fix of {', '.join(sorted(others))}")
        document = rule.fix.apply(self.file, found, self.selection.values(rule))
        if document is self.file.document:
            return
        fixed = _reread(document, self.file)
        error = _error(self.file, fixed, {each.number for each in found})
        if rule.fix.is_safe:
            if self.safe_error + error > MAX_SAFE_ERROR_PER_DIAGONAL * self.file.diagonal:
                self.refused[rule.code] = RefusedFix(rule, error)
                return
            self.safe_error += error
        before = self.applied.get(rule.code, AppliedFix(rule, 0, 0.0))
        count = before.count + sum(each.count for each in found)
        self.applied[rule.code] = AppliedFix(rule, count, before.error_m + error)
        self.file = fixed


def _reread(document: Document, before: CheckedFile) -> CheckedFile:
    """Return the document for the next fix, with the clips and the scene of its written bytes."""
    data = np.concatenate(container.glb(document))
    written = read_contents(container.read(data), file_bytes=before.contents.file_bytes)
    if written.faults:
        raise written.faults[0].at("a fix made the file invalid", ": ")
    contents = written._replace(document=document)
    return CheckedFile(contents, inspect(contents), before.missing)


def _error(before: CheckedFile, after: CheckedFile, numbers: set[int]) -> float:
    """Largest error of a vertex at rest or in any clip, in m. numbers: of the clips that may be gone."""
    names = (*before.skeleton.names, *after.skeleton.names[len(before.skeleton) :])  # renamed nodes are the same ones
    scene = replace(after.scene, skeleton=replace(after.skeleton, names=names))
    metric = ErrorMetric(before.scene, scene)
    prover = Prover(metric)
    old, new = before.contents.clips, after.contents.clips
    kept = old if len(old) == len(new) else {i: clip for i, clip in old.items() if i not in numbers}
    pairs = [(REST, REST), *zip(kept.values(), new.values(), strict=False)]
    by_nodes = max(largest_error(prover, one, other).error.max_error for one, other in pairs)
    return float(max(by_nodes, influence_error(metric, pairs)))
