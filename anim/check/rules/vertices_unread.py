"""GA020: vertices that can't be read."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the error of the meshes, if any."""
    if file.contents.scene_error is not None:
        yield Occurrence("meshes", "/meshes", problem=str(file.contents.scene_error))


RULE = Rule(
    "GA020",
    "vertices-unread",
    Severity.WARNING,
    "Vertices can't be read.",
    "Motion is measured at nodes instead, and rules about skins see nothing.",
    find,
    advice="skins are counted without their vertices",
)
