"""GA102: steps at which nlerp differs visibly from slerp."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from anim.arrays import Bools
from anim.check.checked_file import CheckedFile
from anim.check.edits import edit_tracks, put_between
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameter, Parameters, Rule, counted
from anim.check.track_table import TrackTable
from anim.gltf.document import Document
from anim.maths import quaternion
from anim.model import Interpolation, Track

ANGLE_DEG = 45
ADD_KEYS = "to add keys there: gltf-anim check FILE --fix --select GA102"  # a frame rate may need several tries


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of such steps."""
    angle = parameters["angle"]
    option = "" if angle == ANGLE_DEG else f" --param GA102.angle={angle:g}"
    for each in file.at_keys((table, _wide(table, angle)) for table in file.tracks("rotation", _is_linear)):
        yield replace(each, advice=f"{ADD_KEYS}{option}")


def _wide(table: TrackTable, angle: float) -> Bools:
    """Mask (S,) of the keys at the end of such a step."""
    angles = np.zeros(len(table.values))
    values = quaternion.normalize(table.values)
    dots = np.abs(quaternion.dot(values[1:], values[:-1]))
    angles[1:] = 2 * np.arccos(np.clip(dots, 0, 1))
    return np.asarray(table.inner_steps() & (angles > np.radians(angle)))


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with keys between wide steps, by slerp."""
    return edit_tracks(file, found, lambda track: put_between(track, np.radians(parameters["angle"])))


def _is_linear(track: Track) -> bool:
    return track.interpolation is Interpolation.LINEAR and len(track.values) > 1


RULE = Rule(
    "GA102",
    "nlerp-steps",
    Severity.INFO,
    "Rotations of more than 45° between two keys.",
    "Players that mix components (nlerp: Unity) are off slerp by 0.27° at 60° and 0.92° at 90°.",
    find,
    counted("rotation of more than 45° between keys", "rotations of more than 45° between keys"),
    ADD_KEYS,
    parameters={"angle": Parameter(ANGLE_DEG, "deg", "largest step")},
    fix=Fix("add keys between by slerp", fix, is_safe=True),
    is_default=False,
    targets={"unity": Severity.WARNING},
)
