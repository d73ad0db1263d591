"""GA001: clips without a name."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule, counted


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for clip in file.facts.clips:
        if not clip.name:
            yield file.in_clip(clip.index)


RULE = Rule(
    "GA001",
    "unnamed-clips",
    Severity.WARNING,
    "Clips have no name.",
    "Players choose clips by name; three.js, Babylon and Godot invent one that depends on the order in the file.",
    find,
    counted("clip has no name", "clips have no name"),
    "name them where the file is made",
)
