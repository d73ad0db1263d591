"""GA106: clips of zero duration."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from anim.check.checked_file import CheckedFile
from anim.check.edits import edit_clips
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule, counted
from anim.gltf.document import Document
from anim.model import Clip

DURATION_S = 1 / 30  # of a fixed clip


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips that end when they start."""
    for clip in file.facts.clips:
        if clip.tracks and clip.end_s == clip.start_s:
            yield file.in_clip(clip.index)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with a second key, of the same value, in the first track of these clips."""
    return edit_clips(file, found, _last_one_frame)


def _last_one_frame(clip: Clip) -> Clip:
    from anim.optimization.tracks.clip_ends import extend  # only fixes import optimizations

    first, *others = clip.tracks
    return replace(clip, tracks=(extend(first, clip.start, clip.start + DURATION_S), *others))


RULE = Rule(
    "GA106",
    "one-instant",
    Severity.INFO,
    "Clips have all keys at one time.",
    "A duration of zero gives NaN in bevy before bevyengine/bevy#24996, and hangs libgdx (libgdx/libgdx#2171).",
    find,
    counted("clip is a single pose (duration 0 s)", "clips are single poses (duration 0 s)"),
    "fine for a pose; for players that divide by the duration, give it two keys where it is made",
    fix=Fix("keep the pose for one frame of 1/30 s", fix, is_safe=False),
)
