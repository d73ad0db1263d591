"""GA211: joints whose scale is animated."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from anim.arrays import Bools
from anim.check.checked_file import CheckedFile
from anim.check.edits import remove_tracks_at
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameter, Parameters, Rule, counted
from anim.gltf.document import Document


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of such tracks."""
    yield from file.per_clip(file.scales, _is_moving(file, parameters).astype(np.int64))


def _is_moving(file: CheckedFile, parameters: Parameters) -> Bools:
    """Mask (T,) of the scale tracks that scale a joint."""
    least, most = file.scales.range()
    wide = (most - least).max(axis=1, initial=0.0) > parameters["range"]
    return np.asarray(wide & np.isin(file.scales.nodes, file.joints))


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document without these tracks, as players show it that drop them."""
    return remove_tracks_at(file, "scale", file.scales.targets(_is_moving(file, parameters)))


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
