"""GA102: steps at which nlerp differs visibly from slerp."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameter, Parameters, Rule, counted
from anim.maths import quaternion
from anim.model import Interpolation, Track


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of such steps."""
    table = file.tracks("rotation", _is_linear)
    angles = np.zeros(len(table.values))
    dots = np.abs(quaternion.dot(table.values[1:], table.values[:-1]))
    angles[1:] = 2 * np.arccos(np.clip(dots, 0, 1))
    wide = table.inner_steps() & (angles > np.radians(parameters["angle"]))
    yield from file.per_clip(table, table.count(np.asarray(wide)))


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
    "to add keys: gltf-anim resample IN OUT --fps {finer}{clips}",
    parameters={"angle": Parameter(45, "deg", "largest step")},
    is_default=False,
    targets={"unity": Severity.WARNING},
)
