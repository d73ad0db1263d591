"""GA205: skins without inverse bind matrices."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.gltf.document import json_array


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the skins."""
    for i, skin in enumerate(json_array(file.json, "skins")):
        if "inverseBindMatrices" not in skin:
            yield file.in_skin(i, problem="has no inverse bind matrices: identity matrices are meant")


RULE = Rule(
    "GA205",
    "no-inverse-bind",
    Severity.INFO,
    "A skin has no inverse bind matrices.",
    "glTF takes identity matrices then; converters forget it, and the mesh is bound to wrong places.",
    find,
    advice="write them where the skin is made",
)
