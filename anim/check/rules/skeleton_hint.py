"""GA215: `skin.skeleton` that is not above all joints."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.check.rules.no_common_root import common_ancestors


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the skins."""
    for i, common in common_ancestors(file):
        skin = file.json["skins"][i]
        if common and "skeleton" in skin and skin["skeleton"] not in common:
            yield file.in_skin(i, problem=f"skeleton names node {skin['skeleton']}, which is not above all joints")


RULE = Rule(
    "GA215",
    "skeleton-hint",
    Severity.WARNING,
    "The property `skeleton` of a skin names a node that is not above all joints.",
    "glTF 2.0 demands a common root. Players ignore the property; importers that trust it lose joints.",
    find,
    advice="players ignore the property; leave it out where the skin is made",
)
