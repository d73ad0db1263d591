"""GA101: rotations of 170° or more between two keys."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule, counted


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for clip in file.facts.clips:
        if count := clip.wide_steps:
            yield file.in_clip(clip.index, count)


RULE = Rule(
    "GA101",
    "wide-steps",
    Severity.WARNING,
    "Rotations of 170° or more between two keys.",
    "Players take different ways round: KhronosGroup/glTF-Blender-IO#1253, KhronosGroup/glTF#1515, "
    "godotengine/godot#87813.",
    find,
    counted("rotation of 170° or more between keys", "rotations of 170° or more between keys"),
    "players may differ on the shorter arc; to add keys: gltf-anim resample IN OUT --fps {finer}{clips}",
)
