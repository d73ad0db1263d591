"""Physics extensions as descriptions: both drafts of KHR, OMI, filters, materials, and what is refused."""

from __future__ import annotations

import base64
import json
import math
from typing import Any

import numpy as np
import pytest

from anim.errors import AnimError, FormatError, UnsupportedError
from anim.gltf.document import Document
from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.memory import memory_limit
from anim.simulation.rigid_bodies.description import CollisionFilter, PhysicsDescription, combine
from anim.simulation.rigid_bodies.shapes import scale_shape
from anim.simulation.rigid_bodies.simulate import read_description
from tests.anim.simulation.rigid_bodies.cases import collider, document, needs_rapier, node, path, simulate

SPHERE: list[dict[str, Any]] = [{"type": "sphere", "sphere": {"radius": 0.5}}]


def read(whole: dict[str, Any]) -> PhysicsDescription:
    opened = container.read(np.frombuffer(json.dumps({"asset": {"version": "2.0"}, **whole}).encode(), np.uint8))
    return read_description(opened, reader.skeleton(opened))


def described(made: Document) -> PhysicsDescription:
    return read_description(made, reader.skeleton(made))


def test_motions_are_read_with_infinite_masses() -> None:
    motion = {"mass": 0, "inertiaDiagonal": [1, 0, 2], "linearVelocity": [1, 2, 3], "centerOfMass": [0, 0.1, 0]}
    found = described(document([node(motion=motion, collider=collider(0))], SPHERE)).motions[0]
    assert found.mass == math.inf
    assert (found.inertia_diagonal, found.linear_velocity, found.center_of_mass) == ((1, 0, 2), (1, 2, 3), (0, 0.1, 0))


def test_the_first_draft_has_shapes_of_another_extension() -> None:
    found = read(
        {
            "extensions": {
                "KHR_collision_shapes": {"shapes": [{"type": "capsule", "capsule": {"radius": 0.3, "height": 2}}]},
                "KHR_physics_rigid_bodies": {},
            },
            "nodes": [{"extensions": {"KHR_physics_rigid_bodies": {"motion": {}, "collider": {"shape": 0}}}}],
        }
    )
    shape = found.colliders[0].shape
    assert (shape.kind, shape.size) == ("capsule", (2.0, 0.3, 0.3))


def test_bodies_of_godot_are_read() -> None:
    bodies, moving = "OMI_physics_body", {"mass": 4, "gravityFactor": 0.5}
    found = read(
        {
            "extensions": {"OMI_physics_shape": {"shapes": [{"type": "box", "box": {"size": [1, 2, 3]}}]}},
            "nodes": [
                {
                    "extensions": {bodies: {"motion": {"type": "dynamic", **moving}}},
                    "children": [1],
                },
                {"extensions": {bodies: {"collider": {"shape": 0}}}},
                {"extensions": {bodies: {"motion": {"type": "static"}, "collider": {"shape": 0}}}},
                {"extensions": {bodies: {"motion": {"type": "kinematic"}, "trigger": {"shape": 0}}}},
            ],
        }
    )
    assert (found.motions[0].mass, found.motions[0].gravity_factor) == (4, 0.5)
    assert found.motions[3].kinematic
    assert (set(found.motions), set(found.colliders)) == ({0, 3}, {1, 2})
    assert found.colliders[1].shape.size == (1, 2, 3)


@pytest.mark.parametrize(
    ("modes", "expected"),
    [
        (("average", "multiply"), 0.5),
        (("maximum", "minimum"), 0.2),
        (("multiply", "maximum"), 0.8),
        (("multiply", "multiply"), 0.16),
    ],
)
def test_the_first_mode_of_two_materials_counts(modes: tuple[str, str], expected: float) -> None:
    assert combine(modes, 0.2, 0.8) == pytest.approx(expected)


def test_a_filter_accepts_what_it_names_or_does_not_exclude() -> None:
    land, ghost = CollisionFilter(frozenset({"land"})), CollisionFilter(frozenset({"ghost", "land"}))
    chooses = CollisionFilter(collide_with=frozenset({"land"}))
    excludes = CollisionFilter(not_collide_with=frozenset({"ghost"}))
    plain = CollisionFilter()
    assert chooses.accepts(land)
    assert chooses.accepts(ghost)
    assert not chooses.accepts(plain)
    assert excludes.accepts(land)
    assert excludes.accepts(plain)
    assert not excludes.accepts(ghost)


@needs_rapier
@pytest.mark.parametrize(
    ("of_ball", "of_floor", "falls"),
    [
        ({"collisionSystems": ["ball"]}, {"collideWithSystems": ["ball"]}, False),
        ({"collisionSystems": ["ball"]}, {"collideWithSystems": ["box"]}, True),
        ({"collisionSystems": ["ball"]}, {"notCollideWithSystems": ["ball"]}, True),
        ({"notCollideWithSystems": ["floor"]}, {"collisionSystems": ["floor"]}, True),
        ({"notCollideWithSystems": ["box"]}, {"collisionSystems": ["floor"]}, False),
    ],
)
def test_filters_let_bodies_fall_through(of_ball: dict[str, Any], of_floor: dict[str, Any], *, falls: bool) -> None:
    made = document(
        [
            node((0, 1, 0), motion={}, collider=collider(0, collisionFilter=0)),
            node((0, -0.5, 0), collider=collider(1, collisionFilter=1)),
        ],
        [*SPHERE, {"type": "box", "box": {"size": [9, 1, 9]}}],
        collisionFilters=[of_ball, of_floor],
    )
    height = path(simulate(made, duration=1.5), 0)[-1, 1]
    assert (height < -3) if falls else height == pytest.approx(0.5, abs=0.02)


@needs_rapier
def test_mixed_combine_modes_follow_the_order_of_the_extension() -> None:
    """Rapier alone would take the maximum, which it ranks above the average."""
    materials = [{"restitution": 1.0, "restitutionCombine": "maximum"}, {"restitution": 0.0}]
    made = document(
        [
            node((0, 1.5, 0), motion={}, collider=collider(0, physicsMaterial=0)),
            node(collider=collider(1, physicsMaterial=1)),
        ],
        [*SPHERE, {"type": "plane"}],
        physicsMaterials=materials,
    )
    height = path(simulate(made, duration=0.9), 0)[:, 1]
    assert height[int(np.argmin(height)) :].max() == pytest.approx(0.5 + 0.25, abs=0.02)


@needs_rapier
def test_colliders_below_a_motion_are_one_body() -> None:
    """A dumbbell of two balls falls flat, and its center stays between."""
    balls = [node((x, 0, 0), collider=collider(0)) for x in (-1, 1)]
    made = document(
        [node((0, 2, 0), children=[1, 2], motion={}), *balls, node(collider=collider(1))], [*SPHERE, {"type": "plane"}]
    )
    run = simulate(made, duration=2.0)
    np.testing.assert_allclose(path(run, 0)[-1], [0, 0.5, 0], atol=0.02)
    assert run.report.figures["bodies"] == 1


@needs_rapier
@pytest.mark.parametrize(("kind", "start", "low", "high"), [("capsule", 1.2, 0.2, 0.9), ("cylinder", 0.6, 0.48, 0.52)])
def test_tapered_shapes_come_to_rest(kind: str, start: float, low: float, high: float) -> None:
    """Pushed a little, a tapered capsule tips over, and a tapered cylinder stays on its wide end."""
    shape = {"type": kind, kind: {"radiusTop": 0.2, "radiusBottom": 0.5, "height": 1}}
    falling = node((0, start, 0), motion={"angularVelocity": [0, 0, 0.5]}, collider=collider(0))
    made = document([falling, node(collider=collider(1))], [shape, {"type": "plane"}])
    assert low < path(simulate(made, duration=4.0), 0)[-1, 1] < high


def test_a_scale_makes_an_ellipsoid_a_hull_and_mirrors_nothing() -> None:
    made = document([node(collider=collider(0), motion={})], [*SPHERE])
    sphere = described(made).colliders[0].shape
    assert scale_shape(sphere, np.diag([-2.0, 2, 2])).size == (1.0,)
    flat = scale_shape(sphere, np.diag([1.0, 2, 1]))
    assert flat.kind == "hull"
    np.testing.assert_allclose(np.ptp(flat.points, axis=0), [1, 2, 1], atol=1e-9)


@pytest.mark.parametrize(
    ("physics", "words"),
    [
        ({"motion": {"mass": -1}, "collider": collider(0)}, "mass is -1 kg"),
        ({"motion": {"linearVelocity": [1, 2]}}, "linearVelocity is [1, 2]"),
        ({"motion": {"inertiaDiagonal": [1, -1, 1]}}, "inertia is -1"),
        ({"collider": collider(3)}, "there is no shape 3"),
        ({"collider": {"geometry": {"mesh": 0}}}, "there is no mesh 0"),
        ({"collider": {"geometry": {"node": 0}}}, "no mesh to collide with"),
        ({"collider": {"geometry": {}}}, "no geometry"),
        ({"collider": collider(0, physicsMaterial=2)}, "there is no physics material 2"),
        ({"collider": collider(1)}, "size [0.0]"),
        ({"collider": collider(2)}, "is a 'torus'"),
        ({"joint": {"connectedNode": 7, "joint": 0}}, "there is no node 7"),
        ({"joint": {"connectedNode": 0, "joint": 1}}, "there is no physics joint 1"),
    ],
)
def test_a_faulty_description_is_refused_with_its_node(physics: dict[str, Any], words: str) -> None:
    shapes = [*SPHERE, {"type": "sphere", "sphere": {"radius": 0}}, {"type": "torus"}]
    made = document([node(**physics)], shapes, physicsJoints=[{}])
    with pytest.raises(AnimError) as caught:
        described(made)
    assert words in str(caught.value)
    assert "node 0" in str(caught.value)


@pytest.mark.parametrize(
    ("limits", "drives", "words"),
    [
        ([{"linearAxes": [0], "min": 2, "max": 1}], [], "min below max"),
        ([{"linearAxes": [3], "max": 1}], [], "axes [3]"),
        ([{"max": 1}], [], "linearAxes and angularAxes"),
        ([{"linearAxes": [0], "stiffness": -5}], [], "node 0, KHR_physics_rigid_bodies: a joint's stiffness is -5"),
        ([{"linearAxes": [0], "damping": -5}], [], "node 0, KHR_physics_rigid_bodies: a joint's damping is -5"),
        ([], [{"type": "linear", "mode": "force"}], "axis None"),
        ([], [{"type": "round", "mode": "force", "axis": 0}], "'round'"),
        ([], [{"type": "linear", "mode": "force", "axis": 0, "stiffness": -1}], "stiffness is -1"),
    ],
)
def test_a_faulty_joint_is_refused(limits: list[Any], drives: list[Any], words: str) -> None:
    joint = {"connectedNode": 1, "joint": 0}
    made = document([node(joint=joint), node(motion={})], [], physicsJoints=[{"limits": limits, "drives": drives}])
    with pytest.raises(FormatError, match=words.replace("[", r"\[")):
        described(made)


@needs_rapier
def test_a_shape_that_a_scale_makes_too_large_is_a_fault_of_the_file() -> None:
    large = node(motion={}, collider=collider(0)) | {"scale": [1e6, 1, 1]}
    with pytest.raises(FormatError, match=r"node 0: a box has size \[1000000.0, 1.0, 1.0\] \(limit 100000 m\)"):
        simulate(document([large], [{"type": "box"}]))


@pytest.mark.parametrize("has_meshes", [False, True])
def test_colliders_of_nodes_below_each_other_are_counted_before_they_are_joined(*, has_meshes: bool) -> None:
    """Of a chain of 60 nodes, 1830 meshes."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32).tobytes()
    nodes: list[dict[str, Any]] = [
        {"children": [i + 1], "extensions": {"KHR_physics_rigid_bodies": {"collider": {"geometry": {"node": i}}}}}
        for i in range(60)
    ]
    nodes = [{**each, "mesh": 0} if has_meshes else each for each in nodes]
    chain = {
        "buffers": [
            {"byteLength": 36, "uri": "data:application/octet-stream;base64," + base64.b64encode(corners).decode()}
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [*nodes, {"mesh": 0}],
    }
    assert len(read(chain).colliders[0].shape.faces) == (61 if has_meshes else 1)
    with memory_limit(1_500_000), pytest.raises(UnsupportedError, match="the meshes of all colliders' nodes") as caught:
        read(chain)
    assert "node " in caught.value.where


@needs_rapier
def test_a_joint_of_a_body_with_itself_is_refused() -> None:
    made = document(
        [node(motion={}, children=[1], collider=collider(0)), node(joint={"connectedNode": 0, "joint": 0})],
        SPHERE,
        physicsJoints=[{"limits": []}],
    )
    with pytest.raises(AnimError, match="connects a body with itself"):
        simulate(made)
