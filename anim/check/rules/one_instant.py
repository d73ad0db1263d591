"""GA106: clips of zero duration."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule, counted


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips that end when they start."""
    for clip in file.facts.clips:
        if clip.tracks and clip.end_s == clip.start_s:
            yield file.in_clip(clip.index)


RULE = Rule(
    "GA106",
    "one-instant",
    Severity.INFO,
    "Clips have all keys at one time.",
    "A duration of zero gives NaN in bevy before bevyengine/bevy#24996, and hangs libgdx (libgdx/libgdx#2171).",
    find,
    counted("clip is a single pose (duration 0 s)", "clips are single poses (duration 0 s)"),
    "fine for a pose; for players that divide by the duration, give it two keys where it is made",
)
