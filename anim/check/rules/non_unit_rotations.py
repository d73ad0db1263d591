"""GA104: rotation keys that are not unit quaternions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.edits import edit_tracks
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule, counted
from anim.gltf.document import Document
from anim.maths import quaternion
from anim.measure.inspect.track_statistics import non_unit_keys
from anim.model import Track


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for clip in file.facts.clips:
        if count := clip.non_unit_rotations:
            yield file.in_clip(clip.index, count)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with unit quaternions; tangents are divided by the same lengths."""
    return edit_tracks(file, found, _normalize)


def _normalize(track: Track) -> Track:
    if track.path != "rotation" or not non_unit_keys([track])[0]:
        return track
    lengths = np.sqrt(quaternion.dot(track.values, track.values))[:, None]
    tangents = [None if each is None else each / lengths for each in (track.in_tangents, track.out_tangents)]
    return track.with_keys(track.time_axis, track.values / lengths, *tangents)


RULE = Rule(
    "GA104",
    "non-unit-rotations",
    Severity.WARNING,
    "Rotation keys are not unit quaternions.",
    "glTF 2.0 demands unit length. Players that do not normalize scale or shear the joint.",
    find,
    counted("rotation key is not a unit quaternion", "rotation keys are not unit quaternions"),
    "normalize them where they are made, or: gltf-anim resample IN OUT --fps {fps}{clips}",
    fix=Fix("normalize the quaternions", fix, is_safe=True),
)
