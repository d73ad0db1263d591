"""What a command must leave as it was: the JSON around the animations, and the bytes of everything else."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from anim.gltf.document import Document
from tests.files import opened_path

Json = dict[str, Any]
STORES = ("accessors", "bufferViews", "buffers")


def around(json: Json, *without: str) -> Json:
    """The JSON without the stores of numbers, and without other named properties."""
    return {key: value for key, value in json.items() if key not in (*STORES, *without)}


def check_only_animations_changed(before: Path, after: Path) -> None:
    """Assert that nothing differs but animations and what they are stored in, bytes of meshes and images included."""
    old, new = opened_path(before), opened_path(after)
    assert list(around(new.json)) == list(around(old.json))
    assert around(new.json, "animations") == around(old.json, "animations")
    clips = [[_words(each) for each in document.json.get("animations", ())] for document in (new, old)]
    assert clips[0] == clips[1]
    for kind, number in set(_used(old.json)):
        assert _about(new.json[kind][number], "byteOffset") == _about(old.json[kind][number], "byteOffset")
        views = [number] if kind == "bufferViews" else list(_views(old.json[kind][number]))
        for view in views:
            assert np.array_equal(_bytes(new, view), _bytes(old, view)), (kind, number)


def _words(animation: Json) -> Json:
    """All of an animation but its samplers: names, extras, and channels with their targets."""
    channels = [_about(channel, "sampler") for channel in animation["channels"]]
    return {**_about(animation, "samplers"), "channels": channels}


def _about(part: Json, *without: str) -> Json:
    return {key: value for key, value in part.items() if key not in without}


def _used(json: Json) -> Iterator[tuple[str, int]]:
    """Accessors and views that meshes, skins and images use."""
    for mesh in json.get("meshes", ()):
        for primitive in mesh["primitives"]:
            numbers = [*primitive["attributes"].values(), *([primitive["indices"]] if "indices" in primitive else ())]
            numbers += [number for target in primitive.get("targets", ()) for number in target.values()]
            yield from (("accessors", number) for number in numbers)
    for skin in json.get("skins", ()):
        if "inverseBindMatrices" in skin:
            yield "accessors", skin["inverseBindMatrices"]
    for image in json.get("images", ()):
        if "bufferView" in image:
            yield "bufferViews", image["bufferView"]


def _views(accessor: Json) -> Iterator[int]:
    parts = [accessor, *(accessor.get("sparse", {}).get(key, {}) for key in ("indices", "values"))]
    yield from (part["bufferView"] for part in parts if "bufferView" in part)


def _bytes(document: Document, number: int) -> Any:
    view = document.json["bufferViews"][number]
    start = view.get("byteOffset", 0)
    return document.buffers[view["buffer"]].data[start : start + view["byteLength"]]
