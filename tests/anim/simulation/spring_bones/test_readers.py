"""Spring bones read from VRM 1.0 and VRM 0.x: values, defaults, and refusals with their position."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.errors import FormatError, NotFoundError
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.simulation.spring_bones.angle_limits import AngleLimit, LimitShape
from anim.simulation.spring_bones.chains import SpringBones, SpringJoint, SpringParameters
from anim.simulation.spring_bones.read import read_colliders, read_spring_bones
from tests.files import opened_fixture, opened_path

SPRINGS, EXTENDED, LIMIT = "VRMC_springBone", "VRMC_springBone_extended_collider", "VRMC_springBone_limit"
NODES = [{"name": "a", "children": [1]}, {"name": "b", "translation": [0, 0, -2], "children": [2]}, {"name": "c"}]


def stated(name: str, extension: Any, nodes: list[Any] = NODES) -> SpringBones:
    """Read the extension of a file of three nodes below each other."""
    content = {"asset": {"version": "2.0"}, "nodes": copy.deepcopy(nodes), "extensions": {name: extension}}
    return read_spring_bones(Document(content, ()))


def vrm1(**fields: Any) -> SpringBones:
    return stated(SPRINGS, {"specVersion": "1.0", "springs": [{"joints": [{"node": 0}, {"node": 1}]}], **fields})


# VRM 1.0.


def test_the_fixture_has_every_kind_of_collider() -> None:
    bones = read_spring_bones(opened_fixture("springs"))
    kinds = [(each.shape.value, each.inside) for each in bones.colliders[:5]]
    assert kinds == [("sphere", False), ("capsule", False), ("plane", False), ("sphere", True), ("capsule", True)]
    assert [len(chain.joints) for chain in bones.chains] == [4, 4, 4, 4, 4, 3, 4, 4, 4, 4, 2]
    assert bones.chains[7].center == 0
    assert bones.notes == ()


def test_defaults_are_those_of_the_schema() -> None:
    (chain,) = vrm1().chains
    assert chain.joints == (SpringJoint(0, 1, SpringParameters(1.0, 0.5, (0, 0, 0), 0.0)),)
    assert (chain.name, chain.colliders, chain.center) == ("", (), None)


def test_an_extended_collider_replaces_its_fallback() -> None:
    plane = {"shape": {"plane": {"offset": [0, 1, 0]}}}
    fallback = {"node": 0, "shape": {"sphere": {"radius": 9}}}
    versions = {"1.0": "plane", "1.0-draft": "plane", "7.0": "sphere"}
    for version, shape in versions.items():
        own = {**fallback, "extensions": {EXTENDED: {"specVersion": version, **plane}}}
        bones = vrm1(colliders=[own])
        assert bones.colliders[0].shape == shape
        assert bool(bones.notes) == (shape == "sphere")


def limited(**extension: Any) -> Any:
    """A spring with a limit on its first joint, and an unknown one on its last, which counts nowhere."""
    first = {"node": 0, "extensions": {LIMIT: extension}}
    return [{"joints": [first, {"node": 1, "extensions": {LIMIT: {"specVersion": "0.1"}}}]}]


def test_angle_limits_are_read() -> None:
    limit = {"spherical": {"pitch": 0.5, "yaw": 0.25, "rotation": [1, 0, 0, 0]}}
    bones = vrm1(springs=limited(specVersion="1.0-draft", limit=limit))
    (joint,) = bones.chains[0].joints
    assert joint.limit == AngleLimit(LimitShape.SPHERICAL, 0.5, 0.25, (1, 0, 0, 0))
    assert bones.notes == ()


def test_angle_limits_of_an_unknown_version_are_noted() -> None:
    bones = vrm1(springs=limited(specVersion="7.0", limit={"cube": {}}))
    assert bones.chains[0].joints[0].limit is None
    assert bones.notes == ("VRMC_springBone_limit 7.0 is unknown: its angle limits are not applied",)


@pytest.mark.parametrize(
    ("limit", "problem"),
    [
        ({}, "limit: has no shape"),
        ({"cone": {"angle": 1}, "hinge": {"angle": 1}}, "limit: has cone and hinge"),
        ({"cone": {}}, "cone: has no 'angle'"),
        ({"cone": {"angle": -1}}, "limit: angle is -1"),
        ({"spherical": {"pitch": 1}}, "spherical: has no 'yaw'"),
        ({"hinge": {"angle": 1, "rotation": [0, 0, 0, 0]}}, r"limit: rotation is \(0, 0, 0, 0\)"),
    ],
)
def test_bad_angle_limits_are_named(limit: Any, problem: str) -> None:
    with pytest.raises(FormatError, match=rf"springs\[0\].joints\[0\].extensions.{LIMIT}.*{problem}"):
        vrm1(springs=limited(specVersion="1.0-draft", limit=limit))


def test_a_spring_of_one_joint_has_nothing_to_swing() -> None:
    with pytest.raises(NotFoundError, match="the file has no spring bones"):
        vrm1(springs=[{"joints": [{"node": 0}]}])


def joints(**fields: Any) -> list[Any]:
    return [{"joints": [{"node": 0, **fields}, {"node": 1}]}]


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"springs": 3}, "extensions.VRMC_springBone.springs: is 3 (expected an array)"),
        ({"springs": [{}]}, "springs[0]: has no 'joints'"),
        ({"colliders": 3}, "extensions.VRMC_springBone.colliders: is 3 (expected an array)"),
        ({"colliderGroups": True}, "colliderGroups: is a boolean (expected an array)"),
        ({"springs": joints(node=7)}, "springs[0].joints[0].node: is 7 (the file has 3 nodes)"),
        ({"springs": joints(stiffness="1")}, "springs[0].joints[0].stiffness: is a string (expected a finite number)"),
        ({"springs": joints(dragForce=2)}, "springs[0].joints[0]: drag is 2 (expected 0 to 1)"),
        ({"springs": joints(hitRadius=-1)}, "springs[0].joints[0]: hit radius is -1 (expected 0 or more)"),
        ({"springs": joints(gravityDir=[0, 1])}, "gravityDir: has 2 numbers (expected 3)"),
        ({"springs": [{"joints": [], "colliderGroups": [0]}]}, "is 0 (the file has 0 collider groups)"),
        ({"colliders": [{"node": 0}]}, "colliders[0]: has no 'shape'"),
        (
            {"colliders": [{"node": 0, "shape": {}}]},
            "colliders[0].shape: has no shape (expected one of sphere, capsule)",
        ),
        ({"colliders": [{"node": 0, "shape": {"sphere": {"radius": -2}}}]}, "colliders[0]: radius is -2"),
        ({"colliderGroups": [{"colliders": [1]}]}, "colliderGroups[0].colliders[0]: is 1 (the file has 0 colliders)"),
    ],
)
def test_invalid_extensions_are_refused_with_their_position(fields: dict[str, Any], words: str) -> None:
    with pytest.raises(FormatError) as caught:
        vrm1(**fields)
    assert words in str(caught.value)


# VRM 0.x.


def test_a_real_vrm_0_file(asset: Callable[[str], Path]) -> None:
    document = opened_path(asset("vrm/Godette.vrm"))
    bones = read_spring_bones(document)
    assert len(bones.chains) == 8
    assert len(bones.nodes) == 16
    assert bones.chains[0].joints[0].parameters == SpringParameters(2.5, 0.4, (0, 0, 0), 0.02)
    assert [len(chain.colliders) for chain in bones.chains] == [2, 2, 2, 2, 2, 0, 0, 0]
    assert bones.colliders[0].offset[2] == pytest.approx(0.04, abs=1e-6)  # its z is opposite to that of glTF
    skeleton = reader.skeleton(document)
    for chain in bones.chains:
        last = chain.joints[-1]
        assert last.tail is None
        assert np.linalg.norm(last.tail_offset) == pytest.approx(0.07)
        assert np.cross(last.tail_offset, skeleton.translation[last.node]) == pytest.approx(0, abs=1e-6)


def vrm0(**group: Any) -> SpringBones:
    return stated("VRM", {"secondaryAnimation": {"boneGroups": [{"bones": [0], **group}]}})


def test_every_node_below_a_bone_is_a_joint() -> None:
    (chain,) = vrm0(gravityPower=2, gravityDir={"x": 0, "y": -1, "z": 0.5}, comment="skirt", center=-1).chains
    assert [(joint.node, joint.tail) for joint in chain.joints] == [(0, 1), (1, 2), (2, None)]
    assert chain.name == "skirt"
    assert chain.center is None
    assert chain.joints[0].parameters == SpringParameters(1.0, 0.4, (0, -2, -1), 0.02)


@pytest.mark.parametrize(
    ("group", "words"),
    [
        ({"bones": [5]}, "boneGroups[0].bones[0]: is 5 (the file has 3 nodes)"),
        ({"dragForce": -1}, "boneGroups[0]: drag is -1"),
        ({"center": 1.5}, "boneGroups[0].center: is 1.5 (expected a whole number)"),
        ({"center": -2}, "boneGroups[0].center: is -2 (expected -1 for none, or one of 3 nodes)"),
        ({"center": 3}, "boneGroups[0].center: is 3 (expected -1 for none, or one of 3 nodes)"),
        ({"colliderGroups": [0]}, "colliderGroups[0]: is 0 (the file has 0 collider groups)"),
    ],
)
def test_an_invalid_vrm_0_file_is_refused(group: dict[str, Any], words: str) -> None:
    with pytest.raises(FormatError) as caught:
        vrm0(**group)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("name", "extension", "words"),
    [
        (
            "VRM",
            {"secondaryAnimation": {"boneGroups": [{"bones": [1]}, {"bones": [0] * 1000}]}},
            r"VRM.boneGroups\[1\].bones\[0\]: node 1 'b' is a joint of boneGroups\[0\].bones\[0\] too",
        ),
        (
            SPRINGS,
            {"specVersion": "1.0", "springs": [{"joints": [{"node": 0}, {"node": 1}, {"node": 2}]}] * 1000},
            r"springs\[1\]: node 0 'a' is a joint of springs\[0\] too",
        ),
        (
            "VRM",
            {"secondaryAnimation": {"boneGroups": [{"bones": [0]}] * 1000}},
            r"boneGroups\[1\].bones\[0\]: node 0 'a' is a joint of boneGroups\[0\].bones\[0\] too",
        ),
        (
            SPRINGS,
            {"specVersion": "1.0", "springs": [{"joints": [{"node": 0}, {"node": 0}, {"node": 1}]}]},
            r"springs\[0\]: node 0 'a' is a joint twice",
        ),
    ],
)
def test_a_joint_of_two_springs_is_refused_before_chains_are_built(
    name: str, extension: dict[str, Any], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    built: list[SpringJoint] = []
    monkeypatch.setattr(SpringJoint, "__post_init__", lambda joint: built.append(joint))
    with pytest.raises(FormatError, match=words):
        stated(name, extension)
    assert len(built) <= 3


def test_colliders_are_read_without_chains() -> None:
    springs = [{"joints": [{"node": 0}, {"node": 1}]}] * 2
    sphere = {"node": 2, "shape": {"sphere": {"radius": 0.5}}}
    extension = {"specVersion": "1.0", "springs": springs, "colliders": [sphere]}
    content = {"asset": {"version": "2.0"}, "nodes": NODES, "extensions": {SPRINGS: extension}}
    assert [each.radius for each in read_colliders(Document(content, ()))] == [0.5]


def test_groups_of_colliders_named_twice_count_once() -> None:
    sphere = {"node": 2, "shape": {"sphere": {}}}
    spring = {"joints": [{"node": 0}, {"node": 1}], "colliderGroups": [1, 0] * 10**4}
    groups = [{"colliders": [1, 0] * 10**4}, {"colliders": [1]}]
    (chain,) = vrm1(springs=[spring], colliders=[sphere, sphere], colliderGroups=groups).chains
    assert chain.colliders == (1, 0)
    colliders = [{"node": 2, "colliders": [{}, {}]}, {"node": 2, "colliders": [{}]}]
    about = {"boneGroups": [{"bones": [0], "colliderGroups": [1, 0] * 10**4}], "colliderGroups": colliders}
    assert stated("VRM", {"secondaryAnimation": about}).chains[0].colliders == (2, 0, 1)


def test_chains_of_one_group_share_its_colliders() -> None:
    group = {"bones": [1, 2], "colliderGroups": [0], "comment": "tail"}
    about = {"boneGroups": [group], "colliderGroups": [{"node": 0, "colliders": [{}] * 300}]}
    one, other = stated("VRM", {"secondaryAnimation": about}, [{}, {}, {}]).chains
    assert one.colliders is other.colliders
    assert (one.name, one.joints[0].node, other.joints[0].node, len(one.colliders)) == ("tail", 1, 2, 300)


@pytest.mark.parametrize("extension", [3, {}, {"secondaryAnimation": None}, {"secondaryAnimation": {}}])
def test_a_vrm_0_file_without_springs_has_none(extension: Any) -> None:
    with pytest.raises(NotFoundError, match="the file has no spring bones") as caught:
        stated("VRM", extension)
    assert "`chain`" in caught.value.help
