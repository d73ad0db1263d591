"""GA202: skin weights that do not add up to 1."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from anim.arrays import Floats, Ints
from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.influences import edit_influences
from anim.check.rule import Fix, Parameters, Rule
from anim.gltf.document import Document


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the skins."""
    for skin in file.facts.skins:
        if skin.off_sums:
            error = f"error up to {skin.worst_sum_error:.2g}"
            problem = f"weights of {skin.off_sums} vertices do not add up to 1 ({error})"
            yield file.in_skin(skin.index, skin.off_sums, skin.worst_sum_error or 0.0, problem=problem)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with weights that add up to 1; a vertex without weight follows its first joint."""

    def normalized(skin: int, joints: Ints, weights: Floats) -> tuple[Ints, Floats]:
        weights = weights.copy()
        weights[~weights.any(axis=1), 0] = 1
        return joints, weights / weights.sum(axis=1, keepdims=True)

    return edit_influences(file, {each.number for each in found}, normalized)


RULE = Rule(
    "GA202",
    "weight-sums",
    Severity.WARNING,
    "Skin weights of vertices do not add up to 1.",
    "Some players divide by the sum and some don't, so that vertices are in different places.",
    find,
    advice="normalize weights where the mesh is made",
    fix=Fix("divide them by their sum, as many players do", fix, is_safe=False),
)
