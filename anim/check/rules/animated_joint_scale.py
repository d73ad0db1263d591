"""GA211: joints whose scale is animated."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameter, Parameters, Rule, counted


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of such tracks."""
    table = file.scales
    least, most = table.range()
    moving = ((most - least).max(axis=1, initial=0.0) > parameters["range"]) & np.isin(table.nodes, file.joints)
    yield from file.per_clip(table, moving.astype(np.int64))


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
)
