"""GA007: morph targets without names."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule, counted
from anim.gltf.document import json_array
from anim.gltf.reading import reader


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the meshes."""
    for i, mesh in enumerate(json_array(file.json, "meshes")):
        extras = mesh.get("extras")
        named = isinstance(extras, dict) and extras.get("targetNames")
        if not named and any(primitive.get("targets") for primitive in mesh["primitives"]):
            yield Occurrence(reader.clip_label(mesh.get("name", ""), i, "mesh"), f"/meshes/{i}", number=i)


RULE = Rule(
    "GA007",
    "unnamed-targets",
    Severity.INFO,
    "Morph targets have no names (`extras.targetNames`).",
    'Players then call them by their index: glTFast "0", "1". Lip sync and face tracking look for names.',
    find,
    counted("mesh has morph targets without names", "meshes have morph targets without names"),
    "write targetNames where the file is made",
)
