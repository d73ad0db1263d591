"""GA111: keys that their neighbors interpolate."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule, counted


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for clip in file.facts.clips:
        if count := clip.redundant_keys:
            yield file.in_clip(clip.index, count)


RULE = Rule(
    "GA111",
    "redundant-keys",
    Severity.INFO,
    "Keys are interpolated exactly by their neighbors.",
    "They cost bytes and change nothing.",
    find,
    counted(
        "redundant key (interpolated exactly by its neighbors)",
        "redundant keys (interpolated exactly by their neighbors)",
    ),
    "to remove those that no vertex needs: gltf-anim optimize IN OUT",
)
