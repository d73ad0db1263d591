"""GA101: rotations of 170° or more between two keys."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from anim.check.checked_file import CheckedFile
from anim.check.edits import edit_tracks, put_between
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule, counted
from anim.gltf.document import Document
from anim.measure.inspect.track_statistics import WIDE_STEP_RAD


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for clip in file.facts.clips:
        if count := clip.wide_steps:
            yield file.in_clip(clip.index, count)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with a key in the middle of each wide step, by slerp."""
    return edit_tracks(file, found, lambda track: put_between(track, WIDE_STEP_RAD))


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
    fix=Fix("add a key in the middle by slerp", fix, is_safe=True),
)
