"""GA019: required extensions that are not supported here."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.gltf.validation.extensions import PHYSICS, unknown_required


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the extensions."""
    for name in unknown_required(file.json):
        use = "used by simulate rigid only" if name in PHYSICS else "not supported here"
        problem = f"{name} is required but {use}"
        yield Occurrence("extensionsRequired", "/extensionsRequired", problem=problem, name=name)


RULE = Rule(
    "GA019",
    "unknown-extension",
    Severity.WARNING,
    "The file requires an extension that is not supported here.",
    "Errors are measured without it, so that they may not be what players show.",
    find,
    advice="it stays unchanged; check the result in a viewer that supports it",
)
