"""VRM spring bones by a plain loop of the specification over the JSON of a file: the second route of the tests.

Nothing of `anim` takes part. With `faults`, it does what three-vrm 3.5.5 does otherwise: the length of a joint is that
from its new head to its tail's position before the joint's parents have turned in this step (pixiv/three-vrm#1132), and
a tail below skipped nodes is taken at its own local translation instead of its position in the joint's space.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Json = dict[str, Any]
DRAG = {False: 0.5, True: 0.4}  # by `faults`: what the schema says, and what three-vrm takes


@dataclass
class Spring:
    """A joint, its tail, and its state in center space."""

    node: int
    tail: int | None
    about: Json
    colliders: list[Json]
    center: int | None
    child: Array
    axis: Array
    rest: Array
    now: Array
    before: Array


class Rig:
    """Nodes with their current local transforms."""

    def __init__(self, gltf: Json) -> None:
        nodes = gltf["nodes"]
        self.children: list[list[int]] = [node.get("children", []) for node in nodes]
        self.parents = [-1] * len(nodes)
        for parent, children in enumerate(self.children):
            for child in children:
                self.parents[child] = parent
        self.positions = [np.array(node.get("translation", (0, 0, 0)), float) for node in nodes]
        self.rotations = [np.array(node.get("rotation", (0, 0, 0, 1)), float) for node in nodes]
        self.scales = [np.array(node.get("scale", (1, 1, 1)), float) for node in nodes]

    def local(self, node: int, rotation: Array | None = None) -> Array:
        matrix = np.eye(4)
        matrix[:3, :3] = _matrix(self.rotations[node] if rotation is None else rotation)
        matrix[:3, :3] *= self.scales[node]
        matrix[:3, 3] = self.positions[node]
        return matrix

    def world(self, node: int) -> Array:
        if node < 0:
            return np.eye(4)
        return np.asarray(self.world(self.parents[node]) @ self.local(node))

    def depth(self, node: int) -> int:
        return 0 if node < 0 else 1 + self.depth(self.parents[node])

    def below(self, node: int, tail: int) -> Array:
        """Return a descendant's position in the space of a node."""
        matrix = np.eye(4)
        while tail != node:
            matrix = self.local(tail) @ matrix
            tail = self.parents[tail]
        return np.asarray(matrix[:3, 3])


def simulate(
    gltf: Json, pose: Callable[[Rig, int], None], num_frames: int, dt: float, *, faults: bool = False
) -> tuple[list[int], Array]:
    """Return the joints (J) and their local rotations (F, J, 4). pose: sets the driver's nodes at a frame."""
    rig = Rig(gltf)
    found = list(_springs(gltf, rig))
    pose(rig, 0)
    springs = [_start(rig, *each, faults=faults) for each in found]
    order = _order(rig, springs)
    frames = np.empty((num_frames, len(springs), 4))
    for frame in range(num_frames):
        pose(rig, frame)
        tails = {spring.tail: rig.world(spring.tail)[:3, 3] for spring in springs if spring.tail is not None}
        for spring in order:
            _advance(rig, spring, dt, tails if faults else None, drag=DRAG[faults])
        frames[frame] = [rig.rotations[spring.node] for spring in springs]
    return [spring.node for spring in springs], frames


def _springs(gltf: Json, rig: Rig) -> Iterator[tuple[int, int | None, Json, list[Json], int | None]]:
    extension = gltf["extensions"].get("VRMC_springBone")
    if extension:
        for spring in extension["springs"]:
            groups = [extension["colliderGroups"][i] for i in spring.get("colliderGroups", [])]
            colliders = [extension["colliders"][i] for group in groups for i in group["colliders"]]
            for one, other in zip(spring["joints"], spring["joints"][1:], strict=False):
                yield one["node"], other["node"], one, colliders, spring.get("center")
        return
    animation = gltf["extensions"]["VRM"]["secondaryAnimation"]
    for group in animation["boneGroups"]:
        d = group["gravityDir"]
        about = {"stiffness": group["stiffiness"], "gravityPower": group["gravityPower"]}
        about |= {"dragForce": group["dragForce"], "hitRadius": group["hitRadius"]}
        about["gravityDir"] = [d["x"], d["y"], -d["z"]]
        colliders = []
        for one in (animation["colliderGroups"][i] for i in group["colliderGroups"]):
            for each in one["colliders"]:
                o = each["offset"]
                shape = {"sphere": {"offset": [o["x"], o["y"], -o["z"]], "radius": each["radius"]}}
                colliders.append({"node": one["node"], "shape": shape})
        waiting = list(group["bones"])
        while waiting:
            node = waiting.pop(0)
            children = rig.children[node]
            yield node, children[0] if children else None, about, colliders, None
            waiting = children + waiting


def _start(
    rig: Rig, node: int, tail: int | None, about: Json, colliders: list[Json], center: int | None, *, faults: bool
) -> Spring:
    if tail is None:
        child = _unit(rig.positions[node]) * 0.07
    else:
        child = rig.positions[tail] if faults else rig.below(node, tail)
    to_center = np.linalg.inv(rig.world(-1 if center is None else center))
    now = _at(to_center @ rig.world(node), child)
    return Spring(node, tail, about, colliders, center, child, _unit(child), rig.rotations[node], now, now)


def _order(rig: Rig, springs: list[Spring]) -> list[Spring]:
    """Return the springs so that parents, and what moves colliders, come first."""
    by_node = {spring.node: spring for spring in springs}
    order: list[Spring] = []

    def visit(node: int) -> None:
        if node < 0:
            return
        visit(rig.parents[node])
        spring = by_node.get(node)
        if spring is not None and not any(spring is each for each in order):
            for collider in spring.colliders:
                visit(collider["node"])
            order.append(spring)

    for spring in springs:
        visit(spring.node)
    return order


def _advance(rig: Rig, spring: Spring, dt: float, tails: dict[int, Array] | None, *, drag: float) -> None:
    about = spring.about
    parent = rig.world(rig.parents[spring.node])
    to_world = rig.world(-1 if spring.center is None else spring.center)
    at_rest = parent @ rig.local(spring.node, spring.rest)
    head = at_rest[:3, 3]
    child = (
        spring.child if spring.tail is None else rig.below(spring.node, spring.tail)
    )  # its translation may be animated
    length = np.linalg.norm(_at(at_rest, child) - head)
    if tails is not None and spring.tail is not None:
        length = np.linalg.norm(tails[spring.tail] - head)
    tail: Array = _at(to_world, spring.now + (spring.now - spring.before) * (1 - about.get("dragForce", drag)))
    tail = tail + _unit(at_rest[:3, :3] @ spring.axis) * about.get("stiffness", 1.0) * dt
    tail = tail + np.array(about.get("gravityDir", (0, -1, 0)), float) * about.get("gravityPower", 0.0) * dt
    tail = _within(spring, at_rest, head, head + _unit(tail - head) * length)
    for collider in spring.colliders:
        extended = collider.get("extensions", {}).get("VRMC_springBone_extended_collider", collider)
        direction, distance = _push(extended["shape"], rig.world(collider["node"]), tail, about.get("hitRadius", 0.0))
        if distance < 0:
            tail = _within(spring, at_rest, head, head + _unit(tail - direction * distance - head) * length)
    spring.before, spring.now = spring.now, _at(np.asarray(np.linalg.inv(to_world)), tail)
    rig.rotations[spring.node] = _product(
        spring.rest, _between(spring.axis, _unit(_at(np.asarray(np.linalg.inv(at_rest)), tail)))
    )


def _within(spring: Spring, at_rest: Array, head: Array, tail: Array) -> Array:
    """Return the tail within the joint's limit, by the appendix of VRMC_springBone_limit."""
    extension = spring.about.get("extensions", {}).get("VRMC_springBone_limit")
    if extension is None:
        return tail
    kind, limit = next(iter(extension["limit"].items()))
    x, y, z = spring.axis
    upright = np.array([1.0, 0, 0, 0]) if y == -1 else _unit(np.array([z, 0, -x, y + 1]))
    turn = _matrix(_product(upright, np.array(limit.get("rotation", (0, 0, 0, 1)), float)))
    frame = at_rest[:3, :3] / np.linalg.norm(at_rest[:3, :3], axis=0) @ turn
    return np.asarray(head + frame @ limited(kind, limit, _unit(frame.T @ (tail - head))) * np.linalg.norm(tail - head))


def limited(kind: str, limit: Json, d: Array) -> Array:
    """Return a unit direction within a limit, in the limit's space."""
    if kind == "spherical":
        most_pitch, most_yaw = min(limit["pitch"], np.pi), min(limit["yaw"], np.pi / 2)
        pitch = np.pi if d[1] == -1 else 0.0 if abs(d[0]) == 1 else np.arctan2(d[2], d[1])
        pitch, yaw = max(-most_pitch, min(most_pitch, pitch)), max(-most_yaw, min(most_yaw, np.arcsin(d[0])))
        return np.array([np.sin(yaw), np.cos(yaw) * np.cos(pitch), np.cos(yaw) * np.sin(pitch)])
    angle = min(limit["angle"], np.pi)
    if kind == "hinge":
        d = np.array([0, d[1], d[2]]) if d[1] or d[2] else np.array([0, 1.0, 0])
        d = _unit(d)
    if d[1] >= np.cos(angle):
        return d
    around = np.array([d[0], 0, d[2]])
    around = _unit(around) if around.any() else np.array([0, 0, 1.0])
    return np.asarray(np.sin(angle) * around + np.array([0, np.cos(angle), 0]))


def _matrix(q: Array) -> Array:
    x, y, z, w = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _push(shape: Json, matrix: Array, tail: Array, hit_radius: float) -> tuple[Array, float]:
    """Return the direction away from a collider, and the distance to it, negative inside."""
    kind, body = next(iter(shape.items()))
    delta = tail - _at(matrix, body.get("offset", (0, 0, 0)))
    if kind == "plane":
        normal = _unit(np.linalg.inv(matrix[:3, :3]).T @ np.array(body.get("normal", (0, 0, 1)), float))
        return normal, float(delta @ normal - hit_radius)
    if kind == "capsule":
        along = _at(matrix, body.get("tail", (0, 0, 0))) - _at(matrix, body.get("offset", (0, 0, 0)))
        dot, square = along @ delta, along @ along
        if dot > 0:
            delta = delta - (along if square <= dot else along * dot / square)
    if body.get("inside"):
        return -_unit(delta), float(body["radius"] - hit_radius - np.linalg.norm(delta))
    return _unit(delta), float(np.linalg.norm(delta) - hit_radius - body["radius"])


def _between(a: Array, b: Array) -> Array:
    """Return the shortest rotation from unit a to unit b, as three.js makes it."""
    w = a @ b + 1
    if w < np.finfo(float).eps:
        q = np.array([-a[1], a[0], 0, 0]) if abs(a[0]) > abs(a[2]) else np.array([0, -a[2], a[1], 0])
    else:
        q = np.append(np.cross(a, b), w)
    return _unit(q)


def _product(a: Array, b: Array) -> Array:
    v, w = a[:3], a[3]
    return np.array([*(w * b[:3] + b[3] * v + np.cross(v, b[:3])), w * b[3] - v @ b[:3]])


def _at(matrix: NDArray[Any], point: ArrayLike) -> Array:
    return np.asarray((matrix @ np.append(point, 1.0))[:3])


def _unit(v: Array) -> Array:
    length = np.linalg.norm(v)
    return np.asarray(v / length if length > 0 else v)
