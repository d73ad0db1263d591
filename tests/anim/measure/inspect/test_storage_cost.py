"""What animations cost, against the lengths of JSON texts that the json module writes of the parts themselves."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from anim.gltf.document import Document, Json
from anim.measure.inspect.storage_cost import StorageCost, animation_bytes, storage_costs
from anim.measure.inspect.stored_bytes import stored_bytes
from tests.files import REAL, SHARED, mark_slow, opened_path

KEYS = {"componentType": 5126, "count": 2}
SHARING: Json = {
    "asset": {"version": "2.0"},
    "bufferViews": [{"buffer": 0, "byteLength": 8}, {"buffer": 0, "byteLength": 48, "byteOffset": 8}],
    "accessors": [
        {"bufferView": 0, **KEYS, "type": "SCALAR"},
        {"bufferView": 1, **KEYS, "type": "VEC3"},
        {"bufferView": 1, **KEYS, "type": "VEC3", "byteOffset": 24},
        {**KEYS, "type": "VEC3"},
        {"bufferView": 1, **KEYS, "type": "VEC5"},
    ],
    "animations": [
        {"name": "é", "channels": [], "samplers": [{"input": 0, "output": 1}]},
        {"channels": [], "samplers": [{"input": 0, "output": 2}, {"input": 0, "output": 3}, {"input": 0, "output": 4}]},
    ],
}


def text(part: Any) -> int:
    return len(json.dumps(part, separators=(",", ":"), ensure_ascii=False))


def listed(content: Json, numbers: list[int]) -> tuple[list[Json], list[Json], list[Json]]:
    """The animations, their accessors and their views, each once."""
    chosen = [content["animations"][i] for i in numbers]
    used = {s[key] for a in chosen for s in a["samplers"] for key in ("input", "output")}
    accessors = [content["accessors"][i] for i in sorted(used)]
    places = [part for a in accessors for part in (a, *a.get("sparse", {}).values()) if type(part) is dict]
    views = {place["bufferView"] for place in places if "bufferView" in place}
    return chosen, accessors, [content["bufferViews"][i] for i in sorted(views)]


def json_bytes(content: Json, numbers: list[int]) -> int:
    """Every object and the comma or bracket after it."""
    return sum(text(each) + 1 for part in listed(content, numbers) for each in part)


def test_by_hand() -> None:
    alone, together = storage_costs(Document(SHARING, ()))
    data = [8 + 24, 8 + 24]  # nothing is stored of output 3, and nobody knows what a VEC5 is
    assert alone == [StorageCost(size, json_bytes(SHARING, [i])) for i, size in enumerate(data)]
    assert together == StorageCost(8 + 24 + 24, json_bytes(SHARING, [0, 1]))
    assert together.total == together.data + together.json
    assert animation_bytes(Document(SHARING, ())) == stored_bytes(Document(SHARING, ())) + together.json


def test_no_animations_cost_nothing() -> None:
    assert storage_costs(Document({"asset": {"version": "2.0"}}, ())) == ([], StorageCost(0, 0))


@pytest.mark.parametrize("name", mark_slow(REAL))
def test_real_files_part_by_part(name: str) -> None:
    path: Path = SHARED / "assets" / name
    if not path.is_file():
        pytest.skip(f"{name} is not there")
    document = opened_path(path)
    alone, together = storage_costs(document)
    every = list(range(len(document.json["animations"])))
    assert [each.json for each in alone] == [json_bytes(document.json, [i]) for i in every]
    assert together.json == json_bytes(document.json, every)
    assert animation_bytes(document) == stored_bytes(document) + together.json
    sizes = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
    widths = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5126: 4}
    _, accessors, _ = listed(document.json, every)
    stored = [a for a in accessors if "bufferView" in a or "sparse" in a]
    assert together.data == sum(a["count"] * sizes[a["type"]] * widths[a["componentType"]] for a in stored)
