"""GA116: keys with a scale of zero."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameter, Parameters, Rule, counted
from anim.model import Interpolation


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of such keys; under STEP they hide a node, which works everywhere."""
    table = file.tracks("scale", lambda track: track.interpolation is not Interpolation.STEP)
    zero = np.asarray((np.abs(table.values) < parameters["scale"]).any(axis=1))
    yield from file.per_clip(table, table.count(zero))


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
)
