"""GA211: joints whose scale is animated."""

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
    """Yield the clips with the number of such tracks."""
    yield from file.per_clip(_moving(file, parameters))


def _moving(file: CheckedFile, parameters: Parameters) -> Iterator[tuple[TrackTable, Ints]]:
    """Yield scale tracks, and a 1 (T,) for those that scale a joint."""
    for table in file.tracks("scale"):
        least, most = table.range()
        wide = (most - least).max(axis=1, initial=0.0) > parameters["range"]
        yield table, (wide & np.isin(table.nodes, file.joints)).astype(np.int64)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document without these tracks, as players show it that drop them."""
    targets = {target for table, moving in _moving(file, parameters) for target in table.targets(moving > 0)}
    return remove_tracks_at(file, "scale", targets)


RULE = Rule(
    "GA211",
    "animated-joint-scale",
    Severity.INFO,
    "The scale of joints is animated.",
    "VRM animations and Unity's humanoids drop it.",
    find,
    counted("track scales a joint", "tracks scale joints"),
    "fine where the player keeps it; else leave the tracks out where the file is made",
    parameters={"range": Parameter(1e-3, "", "smallest change of a scale")},
    fix=Fix("remove the tracks", fix, is_safe=False),
)
