"""GA020: vertices that can't be read here."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.errors import UnsupportedError


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield what the meshes need and is not supported, if anything."""
    if isinstance(file.contents.scene_error, UnsupportedError):
        yield Occurrence("meshes", "/meshes", problem=str(file.contents.scene_error))


RULE = Rule(
    "GA020",
    "vertices-unread",
    Severity.WARNING,
    "Vertices can't be read: their compression is not supported, or they exceed the memory limit.",
    "Motion is measured at nodes instead, and rules about skins see nothing.",
    find,
    advice="skins are counted without their vertices",
)
