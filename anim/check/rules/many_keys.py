"""GA110: tracks with more keys a second than a display shows."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from anim.check.checked_file import CheckedFile
from anim.check.edits import edit_clips, single_keys
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameter, Parameters, Rule
from anim.gltf.document import Document
from anim.model import Clip, TimeAxis

MIN_KEYS = 10  # of a track, for a rate
FPS = 60.0  # of a fixed track


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with their highest rate."""
    for report, clip in file.clips:
        rates = [_rate(axis) for axis in clip.time_axes]
        if rates and max(rates) > parameters["rate"]:
            yield file.in_clip(report.index, value=max(rates))


def _rate(axis: TimeAxis) -> float:
    """Keys per second, 0 for few keys."""
    times = axis.times
    return (len(times) - 1) / float(times[-1] - times[0]) if len(times) >= MIN_KEYS else 0.0


def problem(found: Sequence[Occurrence]) -> str:
    """Return the highest rate."""
    return f"up to {max(each.value for each in found):.0f} keys per second"


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with these tracks at 60 frames per second, or a little less, in frames of equal length."""
    return edit_clips(file, found, lambda clip: _slow_down(single_keys(clip, file), parameters["rate"]))


def _slow_down(clip: Clip, limit: float) -> Clip:
    from anim.operations.resample import resample  # only fixes import operations

    duration = clip.end - clip.start
    fps = max(math.floor(duration * min(FPS, limit) + 1e-6), 1) / duration
    tracks = frozenset(i for i, track in enumerate(clip.tracks) if _rate(track.time_axis) > limit)
    return resample(clip, fps=fps, snap=True, tracks=tracks)


RULE = Rule(
    "GA110",
    "many-keys",
    Severity.INFO,
    "Tracks have more keys per second than displays show.",
    "Godot bakes clips to 30 per second, raylib to 60. More keys cost bytes and are not seen.",
    find,
    problem,
    "to keep those that a vertex needs: gltf-anim optimize IN OUT",
    parameters={"rate": Parameter(61, "", "keys per second")},
    fix=Fix("resample to 60 frames per second", fix, is_safe=False),
)
