"""GA112: constant tracks with several keys."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule, counted


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for clip in file.facts.clips:
        if count := clip.repeating_tracks:
            yield file.in_clip(clip.index, count)


RULE = Rule(
    "GA112",
    "constant-tracks",
    Severity.INFO,
    "Constant tracks have several keys.",
    "One key is enough; exporters that sample every frame write files five times as large "
    "(KhronosGroup/glTF-Blender-IO#1884).",
    find,
    counted("constant track has several keys", "constant tracks have several keys"),
    "one key is enough; to reduce them: gltf-anim optimize IN OUT",
)
