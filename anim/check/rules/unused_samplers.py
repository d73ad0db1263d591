"""GA014: samplers that no channel uses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.gltf.document import json_array
from anim.gltf.reading import reader
from anim.gltf.validation.animation_storage import unused_samplers
from anim.units import plural

REWRITE = "to rewrite them without other changes: gltf-anim retime IN OUT --speed 1"


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips."""
    for i, animation in enumerate(json_array(file.json, "animations")):
        if unused := unused_samplers(animation):
            yield in_animation(file, i, problem=f"{plural(len(unused), 'sampler')} in no channel")


def in_animation(file: CheckedFile, number: int, *, problem: str) -> Occurrence:
    """Return an occurrence in an animation, also in one that can't be read."""
    name = file.json["animations"][number].get("name", "")
    found = Occurrence(reader.clip_label(name, number), f"/animations/{number}", problem=problem)
    return replace(found, number=number, name=name)


RULE = Rule(
    "GA014",
    "unused-samplers",
    Severity.INFO,
    "A clip has samplers that no channel uses.",
    "Bytes that no player reads; exporters leave them when channels are removed.",
    find,
    advice=REWRITE,
)
