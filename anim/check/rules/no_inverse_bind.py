"""GA205: skins without inverse bind matrices."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule
from anim.gltf.document import Document, json_array


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the skins."""
    for i, skin in enumerate(json_array(file.json, "skins")):
        if "inverseBindMatrices" not in skin:
            yield file.in_skin(i, problem="has no inverse bind matrices: identity matrices are meant")


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with identity matrices."""
    from anim.gltf.writing.append import append_accessors  # only fixes write

    document = file.document
    for each in found:
        count = len(document.json["skins"][each.number]["joints"])
        identity = np.tile(np.eye(4, dtype="<f4").ravel(), (count, 1))
        document, (accessor,) = append_accessors(document, [(identity, None)])
        skins = [*document.json["skins"]]
        skins[each.number] = {**skins[each.number], "inverseBindMatrices": accessor}
        document = replace(document, json={**document.json, "skins": skins})
    return document


RULE = Rule(
    "GA205",
    "no-inverse-bind",
    Severity.INFO,
    "A skin has no inverse bind matrices.",
    "glTF takes identity matrices then; converters forget it, and the mesh is bound to wrong places.",
    find,
    advice="write them where the skin is made",
    fix=Fix("write identity matrices", fix, is_safe=True),
)
