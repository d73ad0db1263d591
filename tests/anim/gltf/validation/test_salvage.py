"""What is left of a JSON that is not all glTF: valid, with numbers as they were, and every fault named."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from anim.gltf.io import json_text
from anim.gltf.validation import schema
from anim.gltf.validation.salvage import MAX_FAULTS, salvage
from tests.files import opened_fixture

Json = dict[str, Any]


@pytest.fixture
def biped() -> Json:
    content: Json = json.loads(json_text.dump(opened_fixture("biped").json))
    return content


def set_at(content: Any, path: list[Any], value: Any) -> None:
    for key in path[:-1]:
        content = content[key]
    content[path[-1]] = value


@pytest.mark.parametrize(
    ("path", "value", "lost_clips", "lost_skins"),
    [
        (["animations", 1, "channels", 0, "target", "node"], 999, set(), set()),
        (["animations", 1, "samplers", 0, "input"], 999, {1}, set()),
        (["animations", 0], 5, {0}, set()),
        (["nodes", 0, "rotation"], [0, 0, 1], set(), set()),
        (["nodes", 0, "children"], [0], set(), set()),
        (["nodes", 1], None, set(), set()),
        (["skins", 0, "joints"], [], set(), {0}),
        (["skins", 0, "inverseBindMatrices"], 999, set(), set()),
        (["meshes", 0, "primitives"], {}, set(), set()),
        (["scenes"], {}, set(), set()),
        (["asset"], [], set(), set()),
        (["extensionsUsed"], "KHR_x", set(), set()),
        (["bufferViews"], {}, {0, 1, 2}, set()),
        (["buffers"], 1, {0, 1, 2}, set()),
        (["accessors"], "", {0, 1, 2}, set()),
    ],
)
def test_one_fault_takes_what_rests_on_it_and_no_more(
    path: list[Any], value: Any, lost_clips: set[int], lost_skins: set[int], biped: Json
) -> None:
    before = json.dumps(biped)
    set_at(biped, path, value)
    given = json.dumps(biped)
    found = salvage(biped)
    assert json.dumps(biped) == given != before  # is not changed itself
    schema.validate(found.json)
    assert found.faults
    assert found.lost_clips == lost_clips
    assert found.lost_skins == lost_skins
    assert len(found.json["animations"]) == 3


def test_a_view_takes_the_clips_that_lie_in_it(biped: Json) -> None:
    biped["bufferViews"][0]["byteLength"] = 10**9
    found = salvage(biped)
    used = {i for i, each in enumerate(biped["accessors"]) if each.get("bufferView") == 0}
    clips = {
        i
        for i, each in enumerate(biped["animations"])
        if used & {n for sampler in each["samplers"] for n in (sampler["input"], sampler["output"])}
    }
    assert found.lost_clips == clips
    assert len(found.faults) == 1


def test_a_file_of_faults_ends() -> None:
    content = {"asset": {"version": "2.0"}, "nodes": [{"rotation": []} for _ in range(1000)]}
    found = salvage(content)
    assert len(found.faults) == MAX_FAULTS + 1
    schema.validate(found.json)


def test_random_damage_is_survived(biped: Json) -> None:
    """Any value replaced by any other: what is left is valid."""
    rng = np.random.default_rng(3)
    values: list[Callable[[], Any]] = [lambda: None, lambda: -1, list, dict, lambda: "x", lambda: 10**6]
    for _ in range(150):
        damaged = json.loads(json.dumps(biped))
        for _ in range(int(rng.integers(1, 4))):
            part: Any = damaged
            while True:
                keys = list(part) if isinstance(part, dict) else list(range(len(part)))
                key = keys[int(rng.integers(len(keys)))]
                if isinstance(part[key], dict | list) and part[key] and rng.random() < 0.9:
                    part = part[key]
                    continue
                part[key] = values[int(rng.integers(len(values)))]()
                break
        schema.validate(salvage(damaged).json)
