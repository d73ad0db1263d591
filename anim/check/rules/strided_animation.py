"""GA017: animation data in buffer views with byteStride."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule, counted
from anim.check.rules.unused_samplers import REWRITE
from anim.gltf.document import json_array
from anim.gltf.validation.animation_storage import strided


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield one occurrence for all accessors."""
    if not any("byteStride" in view for view in json_array(file.json, "bufferViews")):  # of most files: none
        return
    if found := strided(file.json, *json_array(file.json, "animations")):
        yield Occurrence("animations", f"/accessors/{min(found)}", len(found))


RULE = Rule(
    "GA017",
    "strided-animation",
    Severity.ERROR,
    "Keys are in buffer views with byteStride.",
    "glTF 2.0 allows byteStride for vertex attributes only; players that ignore it read other numbers.",
    find,
    counted("accessor is in a view with byteStride", "accessors are in views with byteStride"),
    advice=REWRITE,
)
