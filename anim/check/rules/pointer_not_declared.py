"""GA501: KHR_animation_pointer that is not in extensionsUsed, or the reverse."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule, counted
from anim.gltf.document import Document, json_array
from anim.gltf.validation.channel_targets import EXTENSION


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the file. Channels whose pointer was lost, as by tools that skip the extension, have no use for it."""
    clips = json_array(file.json, "animations")
    uses = sum(EXTENSION in channel["target"].get("extensions", {}) for clip in clips for channel in clip["channels"])
    if uses and EXTENSION not in file.json.get("extensionsUsed", ()):
        yield Occurrence("extensionsUsed", "/extensionsUsed", uses)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with the extension in extensionsUsed."""
    used = [*file.json.get("extensionsUsed", ()), EXTENSION]
    return replace(file.document, json={**file.json, "extensionsUsed": used})


RULE = Rule(
    "GA501",
    "pointer-not-declared",
    Severity.ERROR,
    "Channels use KHR_animation_pointer, and extensionsUsed does not name it.",
    "Loaders skip extensions that are not declared; validators report an error (donmccurdy/glTF-Transform#1448).",
    find,
    counted(
        f"channel uses {EXTENSION}, which is not in extensionsUsed",
        f"channels use {EXTENSION}, which is not in extensionsUsed",
    ),
    advice="add it to extensionsUsed where the file is made",
    fix=Fix("add it to extensionsUsed", fix, is_safe=True),
)
