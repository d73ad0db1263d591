"""Fixes of rules, each measured on the written bytes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.rule import Rule
from anim.check.selection import RuleSelection
from anim.gltf.document import Document
from anim.gltf.io import container
from anim.measure.continuous_bound.largest_error import largest_error
from anim.measure.continuous_bound.prover import Prover
from anim.measure.error.metric import ErrorMetric
from anim.measure.inspect.contents import read_contents
from anim.measure.inspect.inspect import inspect

MAX_SAFE_ERROR_PER_DIAGONAL = 1e-6


@dataclass(frozen=True, slots=True)
class AppliedFix:
    """A fix that was applied, or refused for its error. count: occurrences. error_m: largest error of a vertex."""

    rule: Rule
    count: int
    error_m: float


@dataclass(frozen=True, slots=True)
class FixResult:
    """The fixed document, the fixes in it, and safe fixes left out because their error was not safe."""

    document: Document
    applied: tuple[AppliedFix, ...]
    refused: tuple[AppliedFix, ...]


def fix_all(file: CheckedFile, selection: RuleSelection, *, unsafe: bool) -> FixResult:
    """Return the document after the fixes of the selected rules. unsafe: also those that may change the motion.

    Each fix is written, read again and compared with the document before: a safe one that moves a vertex by more than
    1e-6 of the diagonal is left out. Files with faults are not fixed.
    """
    applied, refused = [], []
    if file.facts.faults:
        return FixResult(file.document, (), ())
    for rule in selection.rules():
        if rule.fix is None or not (rule.fix.is_safe or unsafe):
            continue
        parameters = selection.values(rule)
        found = list(rule.find(file, parameters))
        if not found:
            continue
        document = rule.fix.apply(file, found, parameters)
        fixed = _reread(document, file)
        done = AppliedFix(rule, sum(each.count for each in found), _error(file, fixed))
        if rule.fix.is_safe and done.error_m > MAX_SAFE_ERROR_PER_DIAGONAL * file.diagonal:
            refused.append(done)
            continue
        applied.append(done)
        file = fixed
    return FixResult(file.document, tuple(applied), tuple(refused))


def _reread(document: Document, before: CheckedFile) -> CheckedFile:
    """Return the document for the next fix, with the clips and the scene of its written bytes."""
    data = np.concatenate(container.glb(document))
    written = read_contents(container.read(data), file_bytes=before.contents.file_bytes)
    if written.faults:
        raise written.faults[0].at("a fix made the file invalid", ": ")
    contents = replace(written, document=document)
    return CheckedFile(contents, inspect(contents), before.missing)


def _error(before: CheckedFile, after: CheckedFile) -> float:
    """Largest error of a vertex in any clip, in m; clips are matched by index."""
    ruler = ErrorMetric(before.scene, after.scene)
    prover = Prover(ruler)
    pairs = ((clip, after.contents.clips.get(i)) for i, clip in before.contents.clips.items())
    errors = (largest_error(prover, old, new).error.max_error for old, new in pairs if new is not None)
    return float(max(errors, default=0.0))
