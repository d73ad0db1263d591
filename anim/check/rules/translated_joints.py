"""GA212: joints whose distance from their parent changes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from anim.arrays import Ints
from anim.check.checked_file import CheckedFile
from anim.check.edits import remove_tracks_at
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameter, Parameters, Rule, counted
from anim.check.track_table import TrackTable
from anim.gltf.document import Document


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of such tracks, of joints below another joint."""
    yield from file.per_clip(_translated(file, parameters))


def _translated(file: CheckedFile, parameters: Parameters) -> Iterator[tuple[TrackTable, Ints]]:
    """Yield translation tracks, and a 1 (T,) for those of inner joints that move."""
    joints = set(file.joints)
    inner = [joint for joint in joints if int(file.skeleton.parents[joint]) in joints]
    for table in file.tracks("translation"):
        least, most = table.range()
        stretched = (most - least).max(axis=1, initial=0.0) > parameters["range"] * file.diagonal
        yield table, (stretched & np.isin(table.nodes, inner)).astype(np.int64)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document without these tracks, as players show it that drop them."""
    targets = {target for table, moving in _translated(file, parameters) for target in table.targets(moving > 0)}
    return remove_tracks_at(file, "translation", targets)


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
    fix=Fix("remove the tracks", fix, is_safe=False),
)
