"""GA116: keys with a scale of zero."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.edits import edit_tracks
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameter, Parameters, Rule, counted
from anim.gltf.document import Document
from anim.model import Interpolation, Track

SMALL_PER_LIMIT = 10.0  # scale of a fixed key, in smallest scales that are not zero


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of such keys; under STEP they hide a node, which works everywhere."""
    tables = file.tracks("scale", lambda track: track.interpolation is not Interpolation.STEP)
    yield from file.at_keys(
        (table, np.asarray((np.abs(table.values) < parameters["scale"]).any(axis=1))) for table in tables
    )


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with a small scale instead of zero."""
    return edit_tracks(file, found, lambda track: _above_zero(track, parameters["scale"]))


def _above_zero(track: Track, limit: float) -> Track:
    zero = np.abs(track.values) < limit
    if track.path != "scale" or track.interpolation is Interpolation.STEP or not zero.any():
        return track
    values = np.where(zero, np.copysign(SMALL_PER_LIMIT * limit, track.values), track.values)
    return track.with_keys(track.time_axis, values, track.in_tangents, track.out_tangents)


RULE = Rule(
    "GA116",
    "zero-scale",
    Severity.WARNING,
    "Keys have a scale of zero.",
    "The matrix has no inverse: normals become NaN (aframevr/aframe#3036, mrdoob/three.js#18026). glTF allows it.",
    find,
    counted("key has a scale of zero", "keys have a scale of zero"),
    "to hide a node, use a small scale, or KHR_node_visibility, where the file is made",
    parameters={"scale": Parameter(1e-6, "", "smallest scale that is not zero")},
    fix=Fix("write a scale of 1e-5", fix, is_safe=False),
)
