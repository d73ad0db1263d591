"""GA502: pointers to properties that plain channels animate."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from anim.check.checked_file import CheckedFile
from anim.check.finding import Occurrence, Severity
from anim.check.rule import Fix, Parameters, Rule, counted
from anim.gltf.document import Document, Json, copy_json
from anim.gltf.reading.accessors import FLOAT
from anim.gltf.validation.channel_targets import EXTENSION, channel_target


def find(file: CheckedFile, parameters: Parameters) -> Iterator[Occurrence]:
    """Yield the clips with the number of such channels."""
    for report, clip in file.clips:
        channels = sum(track.pointer is not None and track.path != "pointer" for track in clip.tracks)
        if channels:
            yield file.in_clip(report.index, channels)


def fix(file: CheckedFile, found: Sequence[Occurrence], parameters: Parameters) -> Document:
    """Return the document with plain channels, and without the extension if nothing else uses it."""
    json = copy_json(file.json)
    for each in found:
        for channel in json["animations"][each.number]["channels"]:
            node, path, pointer = channel_target(channel) or (None, "", None)
            sampler = json["animations"][each.number]["samplers"][channel["sampler"]]
            if node is not None and pointer is not None and _is_plain(json["accessors"][sampler["output"]], path):
                channel["target"] = {"node": node, "path": path}
    if not any(channel["target"]["path"] == "pointer" for clip in json["animations"] for channel in clip["channels"]):
        _remove_extension(json)
    return replace(file.document, json=json) if json != file.json else file.document


def _is_plain(accessor: Json, path: str) -> bool:
    """True if a plain channel may store its values in this way: floats, or rotations and weights in integers."""
    return accessor["componentType"] == FLOAT or (path in ("rotation", "weights") and accessor.get("normalized", False))


def _remove_extension(json: Json) -> None:
    for key in ("extensionsUsed", "extensionsRequired"):
        if EXTENSION in json.get(key, ()):
            json[key] = [name for name in json[key] if name != EXTENSION]
            if not json[key]:
                del json[key]


RULE = Rule(
    "GA502",
    "pointer-for-node-property",
    Severity.INFO,
    "Pointers name a node's translation, rotation, scale or weights.",
    "A plain channel does the same in all players; viewers without KHR_animation_pointer show nothing "
    "(KhronosGroup/UnityGLTF#761).",
    find,
    counted("pointer names a property of a node", "pointers name properties of nodes"),
    "write plain channels where the file is made",
    fix=Fix("write plain channels", fix, is_safe=True),
)
