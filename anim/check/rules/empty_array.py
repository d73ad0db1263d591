"""GA011: empty arrays at the top of the JSON."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.gltf.validation.schema import TOP_ARRAYS


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the empty arrays."""
    for key in sorted(TOP_ARRAYS):
        if file.json.get(key) == []:
            yield Occurrence(key, f"/{key}", problem="is an empty array")


RULE = Rule(
    "GA011",
    "empty-array",
    Severity.ERROR,
    "An array at the top of the JSON is empty.",
    "The schema of glTF 2.0 demands at least one element (minItems); the Khronos validator reports EMPTY_ENTITY.",
    find,
    advice="leave the property out where the file is made",
)
