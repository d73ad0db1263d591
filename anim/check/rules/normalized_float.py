"""GA012: float accessors marked as normalized."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.gltf.document import json_array

WIDE_TYPES = (5125, 5126)  # UNSIGNED_INT, FLOAT


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the accessors."""
    for i, accessor in enumerate(json_array(file.json, "accessors")):
        if accessor.get("normalized") and accessor["componentType"] in WIDE_TYPES:
            yield Occurrence(f"accessor {i}", f"/accessors/{i}", problem="floats are marked normalized", number=i)


RULE = Rule(
    "GA012",
    "normalized-float",
    Severity.ERROR,
    "An accessor of floats or 32-bit integers is marked normalized.",
    "glTF 2.0 allows `normalized` for 8- and 16-bit integers only.",
    find,
    advice="leave the property out where the file is made",
)
