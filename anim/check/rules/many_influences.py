"""GA201: vertices with more influences than most players use."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameter, Parameters, Rule


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the skins."""
    for skin in file.facts.skins:
        if skin.most_influences is not None and skin.most_influences > parameters["influences"]:
            problem = f"up to {skin.most_influences} influences per vertex"
            yield file.in_skin(skin.index, value=skin.most_influences, problem=problem)


RULE = Rule(
    "GA201",
    "many-influences",
    Severity.WARNING,
    "Vertices have more than four influences.",
    "glTF promises one set of four (JOINTS_0). Godot drops the others (godotengine/godot#61912).",
    find,
    advice="many players use the first four only: limit them where the mesh is made",
    parameters={"influences": Parameter(4, "", "influences per vertex that players use")},
)
