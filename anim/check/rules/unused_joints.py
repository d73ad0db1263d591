"""GA213: joints that move no vertex."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the skins."""
    for skin in file.facts.skins:
        if skin.unused_joints:
            problem = f"{skin.unused_joints} of {skin.joints} joints move no vertex"
            yield file.in_skin(skin.index, skin.unused_joints, problem=problem)


RULE = Rule(
    "GA213",
    "unused-joints",
    Severity.INFO,
    "A skin has joints that move no vertex.",
    "They cost a matrix per frame, and bytes if they are animated.",
    find,
    advice="if nothing is attached to them, leave them out where the skin is made",
)
