"""GA013: accessors of an unknown type."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.gltf.document import json_array
from anim.gltf.validation.buffer_layout import COMPONENTS


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the accessors."""
    for i, accessor in enumerate(json_array(file.json, "accessors")):
        if accessor["type"] not in COMPONENTS:
            yield Occurrence(f"accessor {i}", f"/accessors/{i}", problem=f"type is '{accessor['type']}'", number=i)


RULE = Rule(
    "GA013",
    "unknown-type",
    Severity.WARNING,
    "The type of an accessor is none of glTF's.",
    "Readers can't know its size. Nothing that is animated uses it, else the file would be invalid.",
    find,
    advice="use one of glTF's types where the file is made",
)
