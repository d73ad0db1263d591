"""Limits of spring bones' directions: against a plain loop, at singular directions, and on mirrored nodes."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from anim.simulation.spring_bones.angle_limits import AngleLimit, AngleLimits, LimitShape
from tests.anim.simulation.spring_bones import plain_loop
from tests.anim.simulation.spring_bones.cases import Case, chord, swaying
from tests.files import opened_fixture

TURNED = [0.1, 0.2, 0.3, 0.9]
LIMITS: list[dict[str, Any]] = [
    {"cone": {"angle": 0.05}},
    {"hinge": {"angle": 0.1, "rotation": (np.array(TURNED) / np.linalg.norm(TURNED)).tolist()}},
    {"spherical": {"pitch": 0.04, "yaw": 0.08, "rotation": [0, math.sin(0.3), 0, math.cos(0.3)]}},
    {"spherical": {"pitch": 9, "yaw": 9}},
]
HALF = math.sqrt(0.5)
ONE = np.ones((1, 1))


def with_limits(case: Case) -> Case:
    """The springs with a limit on every joint, of all kinds in turn."""
    extension = case.document.json["extensions"]["VRMC_springBone"]
    springs = []
    for spring in extension["springs"]:
        stated = [{"specVersion": "1.0-draft", "limit": LIMITS[i % 4]} for i in range(len(spring["joints"]))]
        joints = [
            {**joint, "extensions": {"VRMC_springBone_limit": each}}
            for joint, each in zip(spring["joints"], stated, strict=True)
        ]
        springs.append({**spring, "joints": joints})
    json = {**case.document.json, "extensions": {"VRMC_springBone": {**extension, "springs": springs}}}
    return replace(case, document=replace(case.document, json=json))


@pytest.mark.slow
def test_limits_agree_with_the_plain_loop() -> None:
    free = swaying(opened_fixture("springs"), num_frames=121)
    case = with_limits(free)
    nodes, found = case.bones.nodes, case.simulate().rotations
    assert chord(nodes, found, *case.plain(faults=False)) < 1e-9
    assert chord(nodes, found, list(nodes), free.simulate().rotations) > 0.1


@pytest.mark.parametrize("kind", LIMITS[:3], ids=["cone", "hinge", "spherical"])
def test_directions_agree_with_the_specification(kind: dict[str, Any]) -> None:
    directions = np.random.default_rng(0).normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    ((name, about),) = kind.items()
    limit = AngleLimit(LimitShape(name), about.get("angle", about.get("pitch")), about.get("yaw", 0.0))
    for direction in (*directions, (0.0, 1.0, 0.0)):
        np.testing.assert_allclose(
            one(limit, direction), plain_loop.limited(name, about, np.array(direction)), atol=1e-12
        )


@pytest.mark.parametrize(
    ("limit", "direction", "expected"),
    [
        (AngleLimit(LimitShape.CONE, math.pi / 4), (0, -1, 0), (0, HALF, HALF)),
        (AngleLimit(LimitShape.HINGE, math.pi / 4), (1, 0, 0), (0, 1, 0)),
        (AngleLimit(LimitShape.HINGE, math.pi / 4), (0, -1, 0), (0, HALF, HALF)),
        (AngleLimit(LimitShape.SPHERICAL, math.pi / 4, math.pi / 4), (-1, 0, 0), (-HALF, HALF, 0)),
        (AngleLimit(LimitShape.SPHERICAL, math.pi / 4, math.pi / 4), (0, -1, 0), (0, HALF, HALF)),
        (AngleLimit(LimitShape.CONE, 99.0), (0, -1, 0), (0, -1, 0)),
        (AngleLimit(LimitShape.CONE, 0.0), (0, 0, 1), (0, 1, 0)),
        (AngleLimit(LimitShape.CONE, math.pi / 4, rotation=(0, 0, HALF, HALF)), (1, 0, 0), (-HALF, 0, HALF)),
    ],
)
def test_singular_directions(limit: AngleLimit, direction: Any, expected: Any) -> None:
    np.testing.assert_allclose(one(limit, direction), expected, atol=1e-12)


def test_a_bone_along_minus_y_turns_its_limit_about_x() -> None:
    found = one(AngleLimit(LimitShape.CONE, math.pi / 4), (0.0, 1.0, 0.0), axis=(0.0, -1.0, 0.0))
    np.testing.assert_allclose(found, (0, -HALF, -HALF), atol=1e-12)


def test_mirrored_nodes_mirror_their_limits() -> None:
    limit = AngleLimit(LimitShape.HINGE, 0.3, rotation=(0, 0, math.sin(0.2), math.cos(0.2)))
    mirror = np.array([-2.0, 2, 2])
    plain = one(limit, (0.5, 0.5, HALF))
    np.testing.assert_allclose(one(limit, (-0.5, 0.5, HALF), linear=np.diag(mirror)), plain * (-1, 1, 1), atol=1e-12)


def one(limit: AngleLimit, direction: Any, *, axis: Any = (0.0, 1.0, 0.0), linear: Any = None) -> Any:
    """The limited direction of one joint at the origin."""
    own = AngleLimits([limit], np.array([axis]))
    world = np.eye(3) if linear is None else linear
    return own.resolve(world[None], np.zeros((1, 3)), ONE, np.array([direction], float))[0]
