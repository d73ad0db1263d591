"""GA105: clips whose first key is late."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.edits import edit_tracks
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule
from anim.gltf.document import Document
from anim.measure.inspect.report import ClipReport
from anim.measure.loops.loop_criteria import VISIBLE_GAP_PER_SIZE
from anim.model import Clip, Track

UNITY = "unity"
LATE_TRACKS = "late tracks"
ADD_KEYS = "to add keys at 0 s: gltf-anim check FILE --fix --select GA105 --target unity"
REBASE = "if unintended, so that it loops without a pause: gltf-anim trim IN OUT --rebase"
MIN_LATE_START_S = 5e-4  # s; starts below come from rounding, and no display shows them


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips; for Unity also those with only some late tracks."""
    for report, clip in file.clips:
        if report.start_s > MIN_LATE_START_S:
            found = file.in_clip(report.index, value=report.start_s, time_s=report.start_s)
            yield replace(found, advice=REBASE, is_fixable=False) if _loops(file, report, clip) else found
        elif parameters.target == UNITY:
            late = [float(track.times[0]) for track in clip.tracks if track.times[0] > MIN_LATE_START_S]
            if late:
                found = file.in_clip(report.index, len(late), max(late), problem=LATE_TRACKS, time_s=max(late))
                yield replace(found, advice=ADD_KEYS)


def _loops(file: CheckedFile, report: ClipReport, clip: Clip) -> bool:
    """Return whether a clip moves and loops, but for a frame: a pause before its first key would be part of that."""
    if report.constant_tracks == len(clip.tracks):
        return False
    return report.index in file.missing_frames or report.seam_m <= VISIBLE_GAP_PER_SIZE * file.diagonal


def problem(found: Sequence[Occurrence]) -> str:
    """Return the range of the first keys, or the number of late tracks."""
    starts = [each.value for each in found]
    least, most = (f"{each:.4f}".rstrip("0").rstrip(".") for each in (min(starts), max(starts)))
    span = least if least == most else f"{least} to {most}"
    if all(each.problem == LATE_TRACKS for each in found):
        count = sum(each.count for each in found)
        tracks = "track has its" if count == 1 else "tracks have their"
        return f"{count} {tracks} first key at {span} s: Unity shows another pose until then"
    return f"first key at {span} s: players hold the first pose until then"


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with a key at 0 s in every late track, with the value of its first key.

    Clips that loop from their first key stay: the motion is the same, but the pause would become part of the loop.
    """
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
    fix=Fix("add a key at 0 s with the first value, which players show until then, unless it loops", fix, is_safe=True),
)
