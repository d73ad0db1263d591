"""GA016: key times without min and max."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.check.rules.unused_samplers import REWRITE
from anim.gltf.document import json_array
from anim.gltf.validation.animation_storage import unbounded


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield one occurrence for all accessors."""
    found = unbounded(file.json, *json_array(file.json, "animations"))
    if found:
        problem = f"{len(found)} key time accessors without min and max"
        yield Occurrence("animations", f"/accessors/{min(found)}", len(found), problem=problem)


RULE = Rule(
    "GA016",
    "missing-bounds",
    Severity.ERROR,
    "Accessors of key times lack min and max.",
    "glTF 2.0 demands them; some players take the duration of a clip from there.",
    find,
    advice=REWRITE,
)
