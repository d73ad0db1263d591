"""Fallback buffers without bytes for compressed views, and the extension names of such views."""

from __future__ import annotations

from collections.abc import Sequence, Set

from anim.gltf.document import Buffer, Json, json_array
from anim.gltf.io import json_text
from anim.gltf.validation.buffer_layout import MESHOPT

NAMES = ("extensionsUsed", "extensionsRequired")


def fallback_json(length: int, extension: str) -> Json:
    """Return the JSON of a fallback buffer."""
    return {"byteLength": length, "extensions": {extension: {"fallback": True}}}


def is_marked(buffer: Json, *extensions: str) -> bool:
    """Return True if a buffer's JSON marks it as fallback, of one of these extensions or of any."""
    there = buffer.get("extensions", {})
    return any(isinstance(there.get(name), dict) and there[name].get("fallback") for name in extensions or MESHOPT)


def drop_data(json: Json, buffers: tuple[Buffer, ...], frozen: Set[int]) -> set[int]:
    """Return the buffers without bytes that are only fallbacks for decompressed views.

    frozen: buffers with immovable bytes.
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
    """Return a fallback buffer for new views of an extension; None if there is none.

    views: the remaining ones. A buffer without remaining views can become this extension's.
    """
    users: dict[int, set[str]] = {i: set() for i in possible}
    for view in views:
        users.get(view["buffer"], set()).add(_extension(view))
    fitting = [i for i in sorted(possible) if users[i] <= {extension}]
    same = [i for i in fitting if users[i] or is_marked(buffers[i], extension)]
    return next(iter(same or fitting), None)


def overhead(json: Json, extension: str) -> int:
    """Return the bytes that an extension's first view adds beside its own JSON: name and buffer."""
    if extension in _used(json):
        return 0
    named = sum(len(json_text.dump({key: [extension]})) - 1 for key in NAMES if extension not in json.get(key, []))
    return named + len(json_text.dump(fallback_json(10_000, extension))) + 1


def name_extensions(json: Json, before: Json, extension: str) -> None:
    """Update `extensionsUsed` and `extensionsRequired` of `json` to its content, in place.

    A name used in `before` but not in `json` is removed; a new one, `extension`, is appended.
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
    """meshopt extensions of any view or buffer."""
    objects = [*json_array(json, "bufferViews"), *json_array(json, "buffers")]
    return {name for each in objects for name in MESHOPT if name in each.get("extensions", {})}


def _extension(view: Json) -> str:
    return next((name for name in MESHOPT if name in view.get("extensions", {})), "")
