"""GA216: inverse bind matrices in buffer views with byteStride."""

from __future__ import annotations

from collections.abc import Iterator

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Parameters, Rule
from anim.gltf.document import json_array
from anim.gltf.validation.animation_storage import with_stride


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the skins."""
    for i, skin in enumerate(json_array(file.json, "skins")):
        accessor = skin.get("inverseBindMatrices")
        if accessor is not None and with_stride(file.json, [accessor]):
            yield file.in_skin(i, problem="inverse bind matrices are in a view with byteStride")


RULE = Rule(
    "GA216",
    "strided-matrices",
    Severity.ERROR,
    "Inverse bind matrices are in a buffer view with byteStride.",
    "glTF 2.0 allows byteStride for vertex attributes only; players that ignore it read other matrices.",
    find,
    advice="give them a separate view where it is made",
)
