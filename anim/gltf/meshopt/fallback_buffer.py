"""Buffers without bytes that compressed views stand in, and the names of the extensions that such views need."""

from __future__ import annotations

from collections.abc import Sequence, Set

from anim.gltf.document import Buffer, Json, json_array
from anim.gltf.io import json_text
from anim.gltf.validation.buffer_layout import MESHOPT

NAMES = ("extensionsUsed", "extensionsRequired")


def fallback_json(length: int, extension: str) -> Json:
    """Return the JSON of a buffer that only stands for bytes."""
    return {"byteLength": length, "extensions": {extension: {"fallback": True}}}


def is_marked(buffer: Json, *extensions: str) -> bool:
    """Return whether a buffer's JSON calls it a fallback, of one of these extensions or of any."""
    there = buffer.get("extensions", {})
    return any(isinstance(there.get(name), dict) and there[name].get("fallback") for name in extensions or MESHOPT)


def drop_data(json: Json, buffers: tuple[Buffer, ...], frozen: Set[int]) -> set[int]:
    """Return the buffers that have no bytes and only stand for what compressed views become.

    frozen: buffers in which nothing may move.
    """
    there = json_array(json, "buffers")
    compressed, others = set[int](), set[int]()
    for view in json_array(json, "bufferViews"):
        extension = _extension(view)
        (compressed if extension else others).add(view["buffer"])
        if extension:
            others.add(view["extensions"][extension]["buffer"])
    possible = {
        i for i, buffer in enumerate(buffers) if not buffer.has_data and (i in compressed or is_marked(there[i]))
    }
    return possible - others - frozen


def find_fallback(buffers: Sequence[Json], views: Sequence[Json], possible: Set[int], extension: str) -> int | None:
    """Return the buffer that new views of an extension can stand in; None where there is none.

    views: those that stay. One that no view is left on can become this extension's.
    """
    users: dict[int, set[str]] = {i: set() for i in possible}
    for view in views:
        users.get(view["buffer"], set()).add(_extension(view))
    fitting = [i for i in sorted(possible) if users[i] <= {extension}]
    same = [i for i in fitting if users[i] or is_marked(buffers[i], extension)]
    return next(iter(same or fitting), None)


def overhead(json: Json, extension: str) -> int:
    """Return what the first view of an extension costs beside its own JSON: its name, and a buffer."""
    if extension in _used(json):
        return 0
    named = sum(len(json_text.dump({key: [extension]})) - 1 for key in NAMES if extension not in json.get(key, []))
    return named + len(json_text.dump(fallback_json(10_000, extension))) + 1


def name_extensions(json: Json, before: Json, extension: str) -> None:
    """Make `extensionsUsed` and `extensionsRequired` of `json` say what it uses, in place.

    A name that `before` used and `json` does not goes; a new one, `extension`, comes last.
    """
    used = _used(json)
    gone = _used(before) - used
    new = [extension] if extension in used else []
    for key in NAMES:
        old = json.get(key, [])
        names = [name for name in old if name not in gone] + [name for name in new if name not in old]
        if names:
            json[key] = names
        elif old:
            del json[key]


def _used(json: Json) -> set[str]:
    """Which of meshopt's extensions any view or buffer carries."""
    objects = [*json_array(json, "bufferViews"), *json_array(json, "buffers")]
    return {name for each in objects for name in MESHOPT if name in each.get("extensions", {})}


def _extension(view: Json) -> str:
    return next((name for name in MESHOPT if name in view.get("extensions", {})), "")
