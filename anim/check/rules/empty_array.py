"""GA011: empty arrays at the top of the JSON, and in clips."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.gltf.document import json_array
from anim.gltf.reading.reader import clip_labels
from anim.gltf.validation.schema import TOP_ARRAYS
from anim.units import plural


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the empty arrays: one occurrence for all clips without channels or samplers."""
    for key in sorted(TOP_ARRAYS):
        if file.json.get(key) == []:
            yield Occurrence(key, f"/{key}", problem="is an empty array")
    clips = json_array(file.json, "animations")
    empty = [
        (each.name, each.index)
        for each in file.facts.clips
        if not (clips[each.index]["channels"] and clips[each.index]["samplers"])
    ]
    if empty:
        name, first = empty[0]
        problem = f"{plural(len(empty), 'clip')} with an empty array of channels or samplers"
        advice = "leave the clip out where the file is made"
        pointer = f"/animations/{first}"
        yield Occurrence(
            clip_labels(empty), pointer, len(empty), problem=problem, advice=advice, number=first, name=name
        )


RULE = Rule(
    "GA011",
    "empty-array",
    Severity.ERROR,
    "An array at the top of the JSON is empty, or one of a clip's channels or samplers.",
    "The schema of glTF 2.0 demands at least one element (minItems); the Khronos validator reports EMPTY_ENTITY.",
    find,
    advice="leave the property out where the file is made",
)
