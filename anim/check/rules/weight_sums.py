"""GA202: skin weights that do not add up to 1."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the skins."""
    for skin in file.facts.skins:
        if skin.off_sums:
            error = f"error up to {skin.worst_sum_error:.2g}"
            problem = f"weights of {skin.off_sums} vertices do not add up to 1 ({error})"
            yield file.in_skin(skin.index, skin.off_sums, skin.worst_sum_error or 0.0, problem=problem)


RULE = Rule(
    "GA202",
    "weight-sums",
    Severity.WARNING,
    "Skin weights of vertices do not add up to 1.",
    "Some players divide by the sum and some don't, so that vertices are in different places.",
    find,
    advice="normalize weights where the mesh is made",
)
