"""Bodies for tests of the engine, and documents with physics extensions, built by hand."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from anim.gltf.document import Document
from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.model import Clip
from anim.simulation.rigid_bodies.description import CollisionFilter, Material, Motion, Shape
from anim.simulation.rigid_bodies.motion import RigidMotion, run_scene
from anim.simulation.rigid_bodies.options import RigidOptions
from anim.simulation.rigid_bodies.rigid_scene import BodyCollider, BodyKind, Frame, RigidBody, RigidJoint, RigidScene
from anim.simulation.rigid_bodies.shape_extents import shape_extent
from anim.simulation.rigid_bodies.simulate import RigidRun, read_description, simulate_rigid_bodies
from anim.simulation.steps import Steps

Array = NDArray[np.float64]
Triple = tuple[float, float, float]
G = 9.81
NO_CLIP = Clip("", ())
KHR, SHAPES = "KHR_physics_rigid_bodies", "KHR_implicit_shapes"
needs_rapier = pytest.mark.skipif(find_spec("rapier3d") is None, reason="the package rapier3d is not there")
ORIGIN = Frame(np.zeros(3), np.array([0.0, 0, 0, 1]))


def frame(position: ArrayLike = (0, 0, 0), rotation: ArrayLike = (0, 0, 0, 1)) -> Frame:
    return Frame(np.array(position, float), np.array(rotation, float))


def body(
    shape: Shape | None,
    position: ArrayLike = (0, 0, 0),
    *,
    velocity: ArrayLike = (0, 0, 0),
    spin: ArrayLike = (0, 0, 0),
    kind: BodyKind = BodyKind.DYNAMIC,
    material: Material | None = None,
    motion: Motion | None = None,
    own: CollisionFilter | None = None,
) -> RigidBody:
    made = [] if shape is None else [BodyCollider(0, shape, ORIGIN, material or Material(), own or CollisionFilter())]
    radius = 0.0 if shape is None else shape_extent(shape).reach
    return RigidBody(
        0,
        kind,
        frame(position),
        tuple(made),
        motion or Motion(),
        np.array(velocity, float),
        np.array(spin, float),
        radius,
    )


def ground(material: Material | None = None) -> RigidBody:
    return body(Shape("plane"), kind=BodyKind.STATIC, material=material)


def box_pile(count: int, static_friction: float = 0.5) -> list[RigidBody]:
    """A floor, and boxes in layers of 16 that lean until they fall over."""
    material, box = Material(static_friction, 0.5), Shape("box", (0.5, 0.5, 0.5))
    rows = [divmod(i, 16) for i in range(count)]
    places = [(i // 4 * 0.6 + 0.05 * y, 0.5 + 0.7 * y, i % 4 * 0.6 + 0.02 * y) for y, i in rows]
    return [ground(material), *(body(box, place, material=material) for place in places)]


def run(
    *bodies: RigidBody,
    seconds: float = 1.0,
    step: float = 1 / 240,
    gravity: Triple = (0, -G, 0),
    joints: Sequence[RigidJoint] = (),
) -> RigidMotion:
    document = Document({"asset": {"version": "2.0"}, "nodes": [{}]}, ())
    scene = RigidScene(tuple(bodies), tuple(joints), gravity)
    return run_scene(
        scene, reader.skeleton(document), NO_CLIP, Steps(step, seconds), substeps=max(1, round(1 / step / 60))
    )


def document(nodes: list[dict[str, Any]], shapes: list[dict[str, Any]], **top: Any) -> Document:
    """A document without meshes: nodes, KHR_implicit_shapes, and the lists of KHR_physics_rigid_bodies."""
    extensions = {SHAPES: {"shapes": shapes}, KHR: top}
    children = {child for node in nodes for child in node.get("children", ())}
    whole = {
        "asset": {"version": "2.0"},
        "extensionsUsed": [KHR, SHAPES],
        "extensions": extensions,
        "scene": 0,
        "scenes": [{"nodes": [i for i in range(len(nodes)) if i not in children]}],
        "nodes": nodes,
    }
    return container.read(np.frombuffer(json.dumps(whole).encode(), np.uint8))


def node(translation: Sequence[float] = (0, 0, 0), *, children: Sequence[int] = (), **physics: Any) -> dict[str, Any]:
    """JSON of a node with properties of KHR_physics_rigid_bodies."""
    made: dict[str, Any] = {"translation": list(translation)}
    if physics:
        made["extensions"] = {KHR: physics}
    return made | ({"children": list(children)} if children else {})


def collider(shape: int, **more: Any) -> dict[str, Any]:
    return {"geometry": {"shape": shape}, **more}


def simulate(source: Document, **options: Any) -> RigidRun:
    scene = reader.scene(source)
    clips = reader.clips(source)
    description = read_description(source, scene.skeleton)
    return simulate_rigid_bodies(scene, clips[0] if clips else NO_CLIP, description, RigidOptions(**options))


def path(found: RigidRun, index: int, name: str = "translation") -> Array:
    """Keys (K, C) of a node's track."""
    return next(track.values for track in found.tracks if (track.node, track.path) == (index, name))


def _box_and_floor() -> bytes:
    moving = {"mass": 2, "angularVelocity": [0, 0, 0]}
    made = document(
        [node((0, 2, 0), motion=moving, collider=collider(0)), node(collider=collider(1))],
        [{"type": "box", "box": {"size": [1, 1, 1]}}, {"type": "plane", "plane": {}}],
    )
    return json.dumps(made.json).encode()


BOX_AND_FLOOR = _box_and_floor()  # the text of a glTF file
