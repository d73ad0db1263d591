"""GA109: keys that are on no frame grid."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from anim.check.advice import MIN_REGULAR_FRACTION
from anim.check.checked_file import CheckedFile
from anim.check.edits import edit_clips, single_keys
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameter, Parameters, Rule
from anim.gltf.document import Document
from anim.model import Clip

FPS = 30.0  # of a fixed clip
MIN_FRAMES = 5  # of a clip that may end between two frames


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for clip in file.facts.clips:
        if clip.frame_rate_regular is not None and clip.frame_rate_regular < parameters["regular"]:
            yield file.in_clip(clip.index, value=clip.frame_rate_regular)


def problem(found: Sequence[Occurrence]) -> str:
    """Return the smallest fraction of keys on a grid."""
    return f"only {math.floor(100 * min(each.value for each in found))} % of key times are on a frame grid"


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with these clips at 30 frames per second; very short ones have frames of equal length."""
    return edit_clips(file, found, lambda clip: _on_grid(clip, file))


def _on_grid(clip: Clip, file: CheckedFile) -> Clip:
    from anim.operations.resample import resample  # only fixes import operations

    frames = (clip.end - clip.start) * FPS
    fps = FPS if frames > MIN_FRAMES else max(round(frames), 1) / (clip.end - clip.start)
    return resample(single_keys(clip, file), fps=fps, snap=True)


RULE = Rule(
    "GA109",
    "irregular-keys",
    Severity.INFO,
    "The keys of a clip are on no usual frame grid.",
    "In a DCC they are on fractions of frames, which makes them hard to edit.",
    find,
    problem,
    "normal for sparse keys; for a grid: gltf-anim resample IN OUT --fps 30{clips}",
    parameters={"regular": Parameter(MIN_REGULAR_FRACTION, "%", "fraction of keys on a grid")},
    fix=Fix("resample to 30 frames per second", fix, is_safe=False, yields_to=frozenset({"GA102"})),
)
