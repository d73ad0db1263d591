"""GA502: pointers to properties that plain channels animate."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule, counted


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of such channels."""
    for report, clip in file.clips():
        channels = sum(track.pointer is not None and track.path != "pointer" for track in clip.tracks)
        if channels:
            yield file.in_clip(report.index, channels)


RULE = Rule(
    "GA502",
    "pointer-for-node-property",
    Severity.INFO,
    "Pointers name a node's translation, rotation, scale or weights.",
    "A plain channel does the same in all players; viewers without KHR_animation_pointer show nothing "
    "(KhronosGroup/UnityGLTF#761).",
    find,
    counted("pointer names a property of a node", "pointers name properties of nodes"),
    "write plain channels where the file is made",
)
