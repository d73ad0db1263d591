"""Sound inputs with spring bones (VRM 1.0, VRM 0.x, JSON) and rigid bodies (KHR, its first draft, OMI), all small."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from typing import Any

import fixtures
from tests.fixtures.reading import split
from tests.fuzz.seed import Seed

Json = dict[str, Any]

SPRING_LINES = (
    "simulate springs IN out.glb --duration 0.1",
    "simulate springs IN out.glb --duration 0.1 --frequency 3 --report report.json",
    "simulate springs IN out.glb --duration 0.1 --frequency 2 --integrator verlet --step 1/240 --scale-aware",
    "simulate springs IN out.glb --duration 0.1 --max-error 1mm --warm-up 0.1",
    "simulate particles IN out.glb --node link0 --colliders vrm --duration 0.1 --rate 20",
    "inspect IN --format json",
    "check IN",
)
FILE_LINES = (
    "simulate springs chain.glb out.glb --springs IN --duration 0.1",
    "simulate springs chain.glb out.glb --springs IN --duration 0.1 --frequency 2 --report report.json",
    "simulate particles chain.glb out.glb --node link0 --colliders IN --duration 0.2 --rate 20",
)
BODY_LINES = (
    "simulate rigid IN out.glb --duration 0.1 --report report.json",
    "simulate rigid IN out.glb --duration 0.1 --step 1/60 --floor 0 --max-error 1mm",
    "simulate particles IN out.glb --node falling --colliders khr --duration 0.1 --rate 20",
    "inspect IN --format json",
    "check IN",
)
SPRING_FILE: Json = {
    "schema": "spring-bones/1",
    "colliders": [
        {"name": "head", "node": "link0", "sphere": {"offset": [0, 0.1, 0], "radius": 0.12}},
        {"name": "arm", "node": "*k0", "capsule": {"offset": [0, 0, 0], "tail": [0, 1, 0], "radius": 0.1}},
        {"name": "floor", "plane": {"normal": [0, 1, 0]}},
        {"name": "inner", "sphere": {"offset": [0, 0, 0], "radius": 9, "inside": True}},
    ],
    "chains": [
        {"root": "link4", "stiffness": 1, "drag": 0.5, "gravity": 0.2, "hit_radius": 0.02, "colliders": ["head"]},
        {"joints": ["link1", "link2", "link3"], "frequency": 2, "damping_ratio": 0.3, "gravity": [0, -1, 0]},
    ],
}
KHR = "KHR_physics_rigid_bodies"


def spring_seeds() -> Iterator[Seed]:
    """Yield a chain with the extensions of VRM 1.0 and 0.x, and one beside a file of chains."""
    for extensions in (_vrm1(), _vrm0()):
        yield Seed("chain.glb", {"chain.glb": _chain(extensions)}, ["chain.glb"], SPRING_LINES)
    files = {"springs.json": json.dumps(SPRING_FILE).encode(), "chain.glb": _chain({})}
    yield Seed("springs.json", files, ["springs.json"], FILE_LINES)


def body_seeds() -> Iterator[Seed]:
    """Yield bodies of the present draft of KHR, of the first one, and of OMI."""
    for make in (_khr, _first_draft, _omi):
        document, blob = split(fixtures.build("morph_cube"))
        extensions = make(document["nodes"])
        document["scenes"][0]["nodes"] = list(range(len(document["nodes"])))
        document |= {"extensions": extensions, "extensionsUsed": [KHR, *extensions]}
        yield Seed("bodies.glb", {"bodies.glb": pack(document, blob)}, ["bodies.glb"], BODY_LINES)


def pack(document: Json, blob: bytes) -> bytes:
    """Return a GLB."""
    content = json.dumps(document).encode()
    content += b" " * (-len(content) % 4)
    chunks = struct.pack("<I4s", len(content), b"JSON") + content + struct.pack("<I4s", len(blob), b"BIN\0") + blob
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _chain(extensions: Json) -> bytes:
    """A chain of six nodes, `link0` … `link5`, below the cube, which moves."""
    document, blob = split(fixtures.build("morph_cube"))
    first = len(document["nodes"])
    for k in range(6):
        document["nodes"].append({"name": f"link{k}", "translation": [0, 0.2, 0.01], "children": [first + k + 1]})
    del document["nodes"][-1]["children"]
    document["nodes"][0]["children"] = [*document["nodes"][0].get("children", []), first]
    if extensions:
        document |= {"extensions": extensions, "extensionsUsed": list(extensions)}
    return pack(document, blob)


def _vrm1() -> Json:
    joint = {"hitRadius": 0.02, "stiffness": 1.0, "gravityPower": 0.5, "gravityDir": [0, -1, 0], "dragForce": 0.4}
    limits = [
        {"cone": {"angle": 0.5, "rotation": [0, 0, 0, 1]}},
        {"hinge": {"angle": 0.5, "rotation": [0, 0, 0, 1]}},
        {"spherical": {"pitch": 0.5, "yaw": 0.3, "rotation": [0, 0, 0, 1]}},
    ]
    joints = [
        {**joint, "node": 2 + k, "extensions": {"VRMC_springBone_limit": {"specVersion": "1.0-draft", "limit": each}}}
        for k, each in enumerate(limits)
    ]
    plane = {"specVersion": "1.0", "shape": {"plane": {"offset": [0, -0.3, 0], "normal": [0, 1, 0]}}}
    sphere = {"sphere": {"offset": [0.02, 0, 0], "radius": 0.1}}
    capsule = {"capsule": {"offset": [0, 0, 0], "tail": [0, 0.2, 0], "radius": 0.05}}
    return {
        "VRMC_springBone": {
            "specVersion": "1.0",
            "colliders": [
                {"node": 0, "shape": sphere},
                {"node": 1, "shape": capsule},
                {"node": 0, "shape": sphere, "extensions": {"VRMC_springBone_extended_collider": plane}},
            ],
            "colliderGroups": [{"name": "all", "colliders": [0, 1, 2]}],
            "springs": [{"name": "tail", "joints": [*joints, {"node": 5}], "colliderGroups": [0], "center": 0}],
        }
    }


def _vrm0() -> Json:
    bones = {
        "comment": "tail",
        "stiffiness": 1.0,
        "gravityPower": 0.3,
        "gravityDir": {"x": 0, "y": -1, "z": 0},
        "dragForce": 0.4,
        "center": 0,
        "hitRadius": 0.02,
        "bones": [2],
        "colliderGroups": [0],
    }
    group = {"node": 1, "colliders": [{"offset": {"x": 0, "y": 0.1, "z": 0.05}, "radius": 0.1}]}
    return {"VRM": {"specVersion": "0.0", "secondaryAnimation": {"boneGroups": [bones], "colliderGroups": [group]}}}


def _khr(nodes: list[Json]) -> Json:
    floor = {"geometry": {"shape": 0}, "physicsMaterial": 0, "collisionFilter": 0}
    motion = {"mass": 2, "centerOfMass": [0, 0.1, 0], "inertiaDiagonal": [1, 1, 1], "inertiaOrientation": [0, 0, 0, 1]}
    moving = {"linearVelocity": [1, 0, 0], "angularVelocity": [0, 1, 0], "gravityFactor": 0.5}
    joint = {"connectedNode": len(nodes) + 2, "joint": 0, "enableCollision": True}
    geometries: list[Json] = [{"shape": k} for k in range(1, 4)] + [{"mesh": 0, "convexHull": True}, {"node": 0}]
    nodes += [
        _body([0, -1, 0], KHR, collider=floor),
        _body([0, -5, 0], KHR, collider={"geometry": {"shape": 4}}),
        *(
            _body([0.5 * k, k, 0], KHR, motion=motion | moving, collider={"geometry": each})
            for k, each in enumerate(geometries)
        ),
        _body([0, 3, 0], KHR, motion={"isKinematic": True}, joint=joint),
    ]
    limits = [
        {"linearAxes": [0, 1, 2], "min": 0, "max": 0},
        {"angularAxes": [0], "min": -0.5, "max": 0.5, "stiffness": 10, "damping": 1},
    ]
    drive = {"type": "angular", "mode": "force", "axis": 1, "maxForce": 10, "velocityTarget": 1, "damping": 2}
    spring = {"type": "linear", "mode": "acceleration", "axis": 0, "positionTarget": 0.1, "stiffness": 5}
    material = {"staticFriction": 0.5, "dynamicFriction": 0.4, "restitution": 0.2, "frictionCombine": "maximum"}
    only = {"collisionSystems": ["a"], "collideWithSystems": ["a", "b"]}
    return {
        KHR: {
            "physicsMaterials": [material],
            "collisionFilters": [only, {"notCollideWithSystems": ["c"]}],
            "physicsJoints": [{"limits": limits, "drives": [drive, spring]}],
        },
        "KHR_implicit_shapes": {"shapes": _shapes("capsule")},
    }


def _first_draft(nodes: list[Json]) -> Json:
    for k in range(4):
        nodes.append(_body([k, 1, 0], KHR, motion={"mass": 1}, collider={"shape": k}))
    hull = {"mesh": {"mesh": 0, "convexHull": True}}
    nodes.append(_body([0, 5, 0], KHR, motion={}, collider=hull))
    return {KHR: {}, "KHR_collision_shapes": {"shapes": _shapes("capsule")}}


def _omi(nodes: list[Json]) -> Json:
    motion = {"type": "dynamic", "mass": 2, "inertiaDiagonal": [0, 0, 0], "gravityFactor": 1}
    for k, kind in enumerate(("static", "dynamic", "kinematic", "dynamic")):
        nodes.append(_body([k, k, 0], "OMI_physics_body", motion=motion | {"type": kind}, collider={"shape": k}))
    return {"OMI_physics_body": {}, "OMI_physics_shape": {"shapes": _shapes("capsule")}}


def _shapes(capsule: str) -> list[Json]:
    return [
        {"type": "box", "box": {"size": [10, 1, 10]}},
        {"type": "sphere", "sphere": {"radius": 0.5}},
        {"type": capsule, capsule: {"height": 1, "radiusTop": 0.2, "radiusBottom": 0.3, "radius": 0.2}},
        {"type": "cylinder", "cylinder": {"height": 1, "radiusTop": 0.3, "radiusBottom": 0.3, "radius": 0.3}},
        {"type": "plane", "plane": {"sizeX": 5, "sizeZ": 5, "doubleSided": True}},
    ]


def _body(translation: list[float], extension: str, **physics: Json) -> Json:
    return {"name": "falling", "translation": translation, "extensions": {extension: physics}}
