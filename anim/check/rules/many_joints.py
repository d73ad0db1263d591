"""GA203: skins with more joints than players promise."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameter, Parameters, Rule


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the skins."""
    for skin in file.facts.skins:
        if skin.joints > parameters["joints"]:
            yield file.in_skin(skin.index, value=skin.joints, problem=f"{skin.joints} joints")


RULE = Rule(
    "GA203",
    "many-joints",
    Severity.WARNING,
    "A skin has more joints than players promise.",
    "256 in bevy and Filament, 254 in Scene Viewer, 110 in Second Life (secondlife/viewer#1530).",
    find,
    advice="split the mesh, or leave joints out, where the skin is made",
    parameters={"joints": Parameter(256, "", "joints of a skin")},
)
