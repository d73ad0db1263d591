"""GA101: rotations of 170° or more between two keys."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.edits import edit_tracks
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule, counted
from anim.gltf.document import Document
from anim.maths import quaternion
from anim.measure.inspect.track_statistics import WIDE_STEP_RAD
from anim.model import Interpolation, Track


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for clip in file.facts.clips:
        if count := clip.wide_steps:
            yield file.in_clip(clip.index, count)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with a key in the middle of each wide step, by slerp."""
    return edit_tracks(file, found, _split)


def _split(track: Track) -> Track:
    if track.path != "rotation" or track.interpolation is not Interpolation.LINEAR or len(track.times) < 2:
        return track
    before, after = track.values[:-1], track.values[1:]
    angles = 2 * np.arccos(np.clip(np.abs(quaternion.dot(before, after)), 0, 1))
    at = np.flatnonzero(angles > WIDE_STEP_RAD)
    if not len(at):
        return track
    middle = quaternion.slerp(before[at], after[at], np.full(len(at), 0.5))
    times = np.insert(track.times, at + 1, (track.times[at] + track.times[at + 1]) / 2)
    return track.with_keys(times, np.insert(track.values, at + 1, middle, axis=0))


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
