"""GA206: skins whose joints have no common root."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.gltf.document import json_array
from anim.gltf.validation import hierarchy


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the skins."""
    for i, common in common_ancestors(file):
        if not common:
            yield file.in_skin(i, problem="joints have no common root")


def common_ancestors(file: CheckedFile) -> Iterator[tuple[int, set[int]]]:
    """Yield the index of each skin and the nodes that are above all of its joints, or are that joint."""
    skins = json_array(file.json, "skins")
    parents = hierarchy.parents(file.json) if skins else []
    for i, skin in enumerate(skins):
        yield i, set.intersection(*(set(_ancestors(joint, parents)) for joint in skin["joints"]))


def _ancestors(node: int, parents: list[int]) -> Iterator[int]:
    while node >= 0:
        yield node
        node = parents[node]


RULE = Rule(
    "GA206",
    "no-common-root",
    Severity.ERROR,
    "The joints of a skin have no common root.",
    "glTF 2.0 demands one. Importers crash or make a static mesh of it (code4game/glTFForUE4#37).",
    find,
    advice="put them under one node where it is made",
)
