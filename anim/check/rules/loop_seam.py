"""GA107: clips that nearly loop."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameter, Parameters, Rule
from anim.units import format_number

LOOP_NAME = re.compile(r"(^|[^a-z])(loop|cycle|idle)([^a-z]|$)", re.IGNORECASE)


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with a small loop gap, and those that loop by name and don't."""
    for clip in file.facts.clips:
        size = clip.seam_m / file.diagonal if file.diagonal else 0.0
        is_named = LOOP_NAME.search(clip.name) is not None
        if size > parameters["gap"] and (size < parameters["limit"] or is_named) and clip.duration_s > 0:
            yield file.in_clip(clip.index, value=size, time_s=clip.end_s)


def problem(found: Sequence[Occurrence]) -> str:
    """Return the largest gap."""
    largest = max(each.value for each in found)
    return f"a loop jumps by {format_number(100 * largest, 2)} % of the model's size"


RULE = Rule(
    "GA107",
    "loop-seam",
    Severity.WARNING,
    "Clips nearly loop: the last pose is close to the first, but not equal.",
    "The jump is visible each time round: KhronosGroup/glTF#573, KhronosGroup/glTF-Blender-IO#1901.",
    find,
    problem,
    "if they are to loop: gltf-anim loop IN OUT --blend 0.1{clips}",
    parameters={
        "gap": Parameter(0.001, "%", "smallest visible jump, of the model's size"),
        "limit": Parameter(0.05, "%", "largest jump of a clip that nearly loops, of the model's size"),
    },
)
