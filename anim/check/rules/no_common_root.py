"""GA206: skins whose joints have no common root."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.gltf.document import json_array


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the skins."""
    for i, skin in enumerate(json_array(file.json, "skins")):
        if not file.have_common_root(skin["joints"]):
            yield file.in_skin(i, problem="joints have no common root")


RULE = Rule(
    "GA206",
    "no-common-root",
    Severity.ERROR,
    "The joints of a skin have no common root.",
    "glTF 2.0 demands one. Importers crash or make a static mesh of it (code4game/glTFForUE4#37).",
    find,
    advice="put them under one node where it is made",
)
