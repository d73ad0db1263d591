"""GA215: `skin.skeleton` that is not above all joints."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.gltf.document import json_array


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the skins."""
    for i, skin in enumerate(json_array(file.json, "skins")):
        if "skeleton" not in skin or not file.have_common_root(skin["joints"]):
            continue
        first, end = file.subtrees
        named, joints = skin["skeleton"], first[skin["joints"]]
        if not ((first[named] <= joints) & (joints < end[named])).all():
            yield file.in_skin(i, problem=f"skeleton names node {named}, which is not above all joints")


RULE = Rule(
    "GA215",
    "skeleton-hint",
    Severity.WARNING,
    "The property `skeleton` of a skin names a node that is not above all joints.",
    "glTF 2.0 demands a common root. Players ignore the property; importers that trust it lose joints.",
    find,
    advice="players ignore the property; leave it out where the skin is made",
)
