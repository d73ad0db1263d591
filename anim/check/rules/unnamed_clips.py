"""GA001: clips without a name."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from anim.check.checked_file import CheckedFile
from anim.check.edits import free_name, rename_clips
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule, counted
from anim.gltf.document import Document


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for clip in file.facts.clips:
        if not clip.name:
            yield file.in_clip(clip.index)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with names: "animation_0", by index."""
    taken = {clip.get("name", "") for clip in file.json["animations"]}
    names = {each.number: free_name(f"animation_{each.number}", taken) for each in found}
    return rename_clips(file.document, names)


RULE = Rule(
    "GA001",
    "unnamed-clips",
    Severity.WARNING,
    "Clips have no name.",
    "Players choose clips by name; three.js, Babylon and Godot invent one that depends on the order in the file.",
    find,
    counted("clip has no name", "clips have no name"),
    "name them where the file is made",
    fix=Fix("name them by their index: animation_0", fix, is_safe=False),
)
