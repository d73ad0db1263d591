"""GA104: rotation keys that are not unit quaternions."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule, counted


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for clip in file.facts.clips:
        if count := clip.non_unit_rotations:
            yield file.in_clip(clip.index, count)


RULE = Rule(
    "GA104",
    "non-unit-rotations",
    Severity.WARNING,
    "Rotation keys are not unit quaternions.",
    "glTF 2.0 demands unit length. Players that do not normalize scale or shear the joint.",
    find,
    counted("rotation key is not a unit quaternion", "rotation keys are not unit quaternions"),
    "normalize them where they are made, or: gltf-anim resample IN OUT --fps {fps}{clips}",
)
