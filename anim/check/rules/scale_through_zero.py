"""GA117: scales that change sign between keys."""

from __future__ import annotations

from collections.abc import Iterator

from anim.arrays import Bools
from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule, counted
from anim.check.track_table import TrackTable


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of such steps."""
    yield from file.at_keys((table, _flips(table)) for table in file.tracks("scale"))


def _flips(table: TrackTable) -> Bools:
    """Mask (S,) of the keys whose sign differs from that of the key before."""
    flips = table.inner_steps()
    flips[1:] &= (table.values[1:] * table.values[:-1] < 0).any(axis=1)
    return flips


RULE = Rule(
    "GA117",
    "scale-through-zero",
    Severity.WARNING,
    "A scale changes its sign between two keys.",
    "On the way it is zero, so that the mesh collapses and turns inside out.",
    find,
    counted("scale changes its sign between keys", "scales change their sign between keys"),
    "use STEP keys there, or two meshes, where the file is made",
)
