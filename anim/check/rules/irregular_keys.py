"""GA109: keys that are on no frame grid."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from anim.check.advice import MIN_REGULAR_FRACTION
from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameter, Parameters, Rule


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for clip in file.facts.clips:
        if clip.frame_rate_regular is not None and clip.frame_rate_regular < parameters["regular"]:
            yield file.in_clip(clip.index, value=clip.frame_rate_regular)


def problem(found: Sequence[Occurrence]) -> str:
    """Return the smallest fraction of keys on a grid."""
    return f"only {math.floor(100 * min(each.value for each in found))} % of key times are on a frame grid"


RULE = Rule(
    "GA109",
    "irregular-keys",
    Severity.INFO,
    "The keys of a clip are on no usual frame grid.",
    "In a DCC they are on fractions of frames, which makes them hard to edit.",
    find,
    problem,
    "normal for sparse keys; for a grid: gltf-anim resample IN OUT --fps 30{clips}",
    parameters={"regular": Parameter(MIN_REGULAR_FRACTION, "%", "fraction of keys on a grid")},
)
