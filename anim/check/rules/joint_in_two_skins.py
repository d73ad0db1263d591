"""GA204: joints of several skins."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.gltf.document import json_array
from anim.units import plural


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield one occurrence, for the first joint."""
    skins = json_array(file.json, "skins")
    counts = Counter(joint for skin in skins for joint in set(skin["joints"]))
    shared = sorted(joint for joint, count in counts.items() if count > 1)
    if shared:
        verb = "belongs" if len(shared) == 1 else "belong"
        problem = f"{plural(len(shared), 'joint')} {verb} to several of the {len(skins)} skins"
        yield file.in_node(shared[0], len(shared), problem=problem)


RULE = Rule(
    "GA204",
    "joint-in-two-skins",
    Severity.INFO,
    "Joints belong to several skins.",
    "glTF allows it, and characters of several meshes have it. raylib reads one skin, Quick Look one skeleton.",
    find,
    advice="one skin for all meshes of a character works everywhere: share it where the file is made",
)
