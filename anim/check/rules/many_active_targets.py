"""GA119: more morph targets at once than glTF promises."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameter, Parameters, Rule
from anim.sampling.weight_pointers import resolve_weight_pointers

MIN_WEIGHT = 1e-6


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the largest number at a key."""
    for report, clip in file.clips:
        tracks = resolve_weight_pointers(file.skeleton, clip).tracks
        weights = [track.values for track in tracks if track.path == "weights"]
        most = [int((np.abs(values) > MIN_WEIGHT).sum(axis=1).max()) for values in weights]
        if most and max(most) > parameters["targets"]:
            yield file.in_clip(report.index, value=max(most))


def problem(found: Sequence[Occurrence]) -> str:
    """Return the largest number of targets."""
    return f"up to {max(each.value for each in found):.0f} morph targets of a mesh are active at once"


RULE = Rule(
    "GA119",
    "many-active-targets",
    Severity.INFO,
    "More morph targets of a mesh are active at once than players promise.",
    "glTF promises 8 (KhronosGroup/glTF#977); some players drop the others.",
    find,
    problem,
    "check it in the player that counts, or merge targets where the file is made",
    parameters={"targets": Parameter(8, "", "active targets of a mesh")},
)
