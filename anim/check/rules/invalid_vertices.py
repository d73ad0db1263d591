"""GA022: meshes and skins that break glTF."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.errors import UnsupportedError


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the first fault of the meshes and skins, unless the file has faults (GA010) of which it is a result."""
    error = file.contents.scene_error
    if error is not None and not isinstance(error, UnsupportedError) and not file.facts.faults:
        yield Occurrence("meshes", "/meshes", problem=str(error))


RULE = Rule(
    "GA022",
    "invalid-vertices",
    Severity.ERROR,
    "A mesh or skin is not valid glTF: numbers that are not finite, joints that the skin lacks, negative weights.",
    "Commands that need vertices refuse the file, and the others measure motion at nodes.",
    find,
    advice="fix it where the file is made; rules about skins see nothing of it",
)
