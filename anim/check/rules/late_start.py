"""GA105: clips whose first key is late."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.edits import edit_tracks
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule
from anim.gltf.document import Document
from anim.model import Track

MIN_LATE_START_S = 5e-4  # s; starts below come from rounding, and no display shows them


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for clip in file.facts.clips:
        if clip.start_s > MIN_LATE_START_S:
            yield file.in_clip(clip.index, value=clip.start_s, time_s=0.0)


def problem(found: Sequence[Occurrence]) -> str:
    """Return the range of the first keys."""
    starts = [each.value for each in found]
    least, most = (f"{each:.4f}".rstrip("0").rstrip(".") for each in (min(starts), max(starts)))
    return f"first key at {least if least == most else f'{least} to {most}'} s: players hold the first pose until then"


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with a key at 0 s in every late track, with the value of its first key."""
    return edit_tracks(file, found, _hold)


def _hold(track: Track) -> Track:
    if track.times[0] <= MIN_LATE_START_S:
        return track
    times, values = np.concatenate(([0.0], track.times)), np.concatenate((track.values[:1], track.values))
    if track.in_tangents is None or track.out_tangents is None:
        return track.with_keys(times, values)
    still = np.zeros_like(values[:1])
    arriving = np.concatenate((still, still, track.in_tangents[1:]))
    return track.with_keys(times, values, arriving, np.concatenate((still, track.out_tangents)))


RULE = Rule(
    "GA105",
    "late-start",
    Severity.INFO,
    "The first key of a clip is later than 0 s.",
    "glTF counts from 0: the first pose stands still until then. Players differ: KhronosGroup/glTF#1327, #1408, "
    "KhronosGroup/glTF-Blender-IO#387.",
    find,
    problem,
    "if unintended: gltf-anim trim IN OUT --rebase",
    targets={"unity": Severity.WARNING},
    fix=Fix("add a key at 0 s with the first value, which players show until then", fix, is_safe=True),
)
