"""Springs read from JSON of our own: all keys, and refusals with their position."""

from __future__ import annotations

import json
from typing import Any

import pytest

from anim.errors import AnimError, FormatError, NotFoundError
from anim.model import Skeleton
from anim.simulation.spring_bones.chains import SpringBones, SpringJoint, SpringParameters
from anim.simulation.spring_bones.colliders import Collider, ColliderShape
from anim.simulation.spring_bones.json_reader import read_spring_file
from tests.anim.simulation.spring_bones.test_chain_globs import rig


def parsed(content: dict[str, Any], skeleton: Skeleton | None = None) -> SpringBones:
    data = json.dumps({"schema": "spring-bones/1", **content}).encode()
    return read_spring_file(data, skeleton or rig(), skin_joints={0, 1, 2, 3, 5, 6})


def test_a_file_of_all_keys() -> None:
    bones = parsed(
        {
            "colliders": [
                {"name": "body", "node": "Body", "sphere": {"offset": [0, 0, 1], "radius": 0.5, "inside": True}},
                {"name": "floor", "plane": {"normal": [0, 1, 0]}},
            ],
            "chains": [
                {"name": "tail", "root": "Tail*", "stiffness": 2, "drag": 0.1, "gravity": 0.5, "hit_radius": 0.05},
                {"root": "Ear.L", "frequency": 3, "damping_ratio": 0.2, "gravity": [1, 0, 0], "colliders": ["floor"]},
                {"joints": ["Body", "Ear.R"], "center": "Body", "colliders": []},
            ],
        }
    )
    tail, ear, body = bones.chains
    assert bones.colliders[0] == Collider(0, ColliderShape.SPHERE, (0, 0, 1), radius=0.5, inside=True, name="body")
    assert bones.colliders[1].node is None
    assert [joint.node for joint in tail.joints] == [1, 2, 3]
    assert tail.name == "tail"
    assert tail.colliders == (0, 1)
    assert tail.joints[0].parameters == SpringParameters(2, 0.1, (0, -0.5, 0), 0.05)
    assert ear.colliders == (1,)
    assert ear.joints[0].parameters == SpringParameters(gravity=(1, 0, 0), frequency=3, damping_ratio=0.2)
    assert body.joints == (SpringJoint(0, 6, SpringParameters()),)
    assert (body.center, body.colliders) == (0, ())


@pytest.mark.parametrize(
    ("content", "kind", "words"),
    [
        ({}, FormatError, "has no chains"),
        ({"schema": "x", "chains": [{}]}, FormatError, "schema is 'x' (expected 'spring-bones/1')"),
        ({"chain": []}, FormatError, "unknown key 'chain'"),
        ({"chains": [{"root": "Tail1", "stifness": 1}]}, FormatError, "chains[0]: unknown key 'stifness'"),
        ({"chains": [{}]}, FormatError, "chains[0]: has neither root nor joints"),
        ({"chains": [{"root": "Tail1", "joints": ["Body", "Ear.L"]}]}, FormatError, "has both root and joints"),
        ({"chains": [{"joints": ["Body"]}]}, FormatError, "chains[0]: has fewer than two joints"),
        ({"chains": [{"root": "Tial1"}]}, NotFoundError, "chains[0]: no node matches 'Tial1'"),
        ({"chains": [{"joints": ["Ear*", "Body"]}]}, FormatError, "'Ear*' matches 2 nodes (expected one)"),
        ({"chains": [{"root": "Tail1", "drag": 3}]}, FormatError, "chains[0]: drag is 3 (expected 0 to 1)"),
        ({"chains": [{"root": "Tail1", "gravity": "x"}]}, FormatError, "chains[0].gravity: is a string"),
        ({"chains": [{"root": "Tail1", "colliders": ["x"]}]}, NotFoundError, "no collider matches 'x'"),
        ({"colliders": [{"node": "Body"}], "chains": [{"root": "Tail1"}]}, FormatError, "colliders[0]: has no shape"),
    ],
)
def test_an_invalid_file_is_refused_with_its_position(
    content: dict[str, Any], kind: type[AnimError], words: str
) -> None:
    with pytest.raises(kind) as caught:
        parsed(content)
    assert words in str(caught.value)


def test_text_that_is_no_json_is_refused() -> None:
    with pytest.raises(FormatError, match="JSON is broken at line 1"):
        read_spring_file(b"{", rig())
