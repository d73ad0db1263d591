"""GA212: joints whose distance from their parent changes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameter, Parameters, Rule, counted


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of such tracks, of joints below another joint."""
    joints = set(file.joints)
    inner = [joint for joint in joints if int(file.skeleton.parents[joint]) in joints]
    table = file.tracks("translation")
    least, most = table.range()
    stretched = (most - least).max(axis=1, initial=0.0) > parameters["range"] * file.diagonal
    yield from file.per_clip(table, (stretched & np.isin(table.nodes, inner)).astype(np.int64))


RULE = Rule(
    "GA212",
    "translated-joints",
    Severity.INFO,
    "Joints below others are translated.",
    "Retargeting keeps lengths, and VRM animations allow translations of the hips only.",
    find,
    counted("track translates a joint below another", "tracks translate joints below others"),
    "fine on the same skeleton; for others use rotations where the clip is made",
    parameters={"range": Parameter(1e-3, "%", "largest range, of the model's size")},
    is_default=False,
)
