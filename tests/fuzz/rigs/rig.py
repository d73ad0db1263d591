"""Random sound rigs with odd features: mirrored and tiny nodes, matrices, shared meshes, skins, morphs, pointers."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tests.fuzz.rigs.clips import add_clips
from tests.fuzz.rigs.glb_builder import GlbBuilder, Json

SIDES, RINGS = 4, 4  # of a tube
NAMES = ("bone", "ä ö", "a/b", "{clip}", "")
SCALES = ([2.0, 2.0, 2.0], [0.01, 0.01, 0.01], [-1.0, 1.0, 1.0], [1.0, 2.0, 1.0], [1.0, 1.0, -1.5])


def make_rig(seed: int) -> bytes:
    """Return a GLB of 2 to 8 joints, 1 to 3 meshes, and 1 to 3 clips: the same for a seed."""
    return _Rig(np.random.default_rng(seed)).build()


class _Rig:
    """Rig in the making. unit: size of its parts."""

    def __init__(self, random: np.random.Generator) -> None:
        self._random = random
        self._file = GlbBuilder()
        self._unit = float(random.choice([1, 1, 1, 0.01, 100.0]))
        self._nodes = self._file.lists["nodes"]
        self._roots: list[int] = []
        self._worlds: list[Any] = []
        self._num_targets: dict[int, int] = {}  # by node with a morphed mesh

    def build(self) -> bytes:
        """Return the file."""
        for i in range(int(self._random.integers(2, 9))):
            self._add_joint(i)
        for _ in range(int(self._random.integers(1, 4))):
            self._add_mesh()
        has_pointers = add_clips(self._file, self._random, self._unit, self._num_targets)
        top: Json = {"scenes": [{"nodes": self._roots}]}
        top |= {"scene": 0} if self._chance(0.8) else {}
        top |= {"extensionsUsed": ["KHR_animation_pointer"]} if has_pointers else {}
        return self._file.to_bytes(**top)

    def _chance(self, probability: float) -> bool:
        return bool(self._random.random() < probability)

    def _add_joint(self, i: int) -> None:
        translation = (self._random.normal(size=3) * 0.3 * self._unit).tolist()
        node: Json = {"translation": translation} if self._chance(0.9) else {}
        if self._chance(0.6):
            node["rotation"] = Rotation.random(random_state=int(self._random.integers(1 << 30))).as_quat().tolist()
        if self._chance(0.25):
            node["scale"] = SCALES[self._random.integers(len(SCALES))]
        parent = -1
        if i and not self._chance(0.05):
            parent = int(self._random.integers(0 if self._chance(0.15) else max(0, i - 2), i))
        local = _matrix(node)
        if self._chance(0.12) and len(set(node.get("scale", [1.0]))) == 1:
            node = {"matrix": local.T.reshape(16).tolist()}
        if self._chance(0.9):
            node["name"] = f"joint{i}" if self._chance(0.8) else NAMES[self._random.integers(len(NAMES))]
        self._file.add("nodes", node)
        self._worlds.append(self._worlds[parent] @ local if parent >= 0 else local)
        self._place(i, parent)

    def _place(self, node: int, parent: int) -> None:
        (self._roots if parent < 0 else self._nodes[parent].setdefault("children", [])).append(node)

    def _add_mesh(self) -> None:
        random = self._random
        num_targets = int(random.integers(1, 4)) if self._chance(0.5) else 0
        skin = self._add_skin() if self._chance(0.6) else -1
        num_joints = len(self._file.lists["skins"][skin]["joints"]) if skin >= 0 else 0
        count = 1 if self._chance(0.7) else 2
        mesh: Json = {"primitives": [self._make_primitive(num_joints, num_targets) for _ in range(count)]}
        mesh |= {"weights": random.random(num_targets).tolist()} if num_targets and self._chance(0.4) else {}
        mesh |= {"name": str(random.choice(["mesh", "Körper"]))} if self._chance(0.5) else {}
        index = self._file.add("meshes", mesh)
        for _ in range(1 if self._chance(0.8) else 2):
            node: Json = {"mesh": index} | ({"skin": skin} if skin >= 0 else {})
            node |= {"name": f"body{len(self._nodes)}"} if self._chance(0.5) else {}
            node |= {"translation": (random.normal(size=3) * self._unit).tolist()} if self._chance(0.3) else {}
            node |= {"weights": random.random(num_targets).tolist()} if num_targets and self._chance(0.2) else {}
            added = self._file.add("nodes", node)
            self._place(added, -1 if self._chance(0.5) else int(random.integers(len(self._worlds))))
            if num_targets:
                self._num_targets[added] = num_targets

    def _add_skin(self) -> int:
        count = len(self._worlds)
        size = int(self._random.integers(1, count + 1))
        joints = sorted(self._random.choice(count, size=size, replace=False).tolist())
        joints = joints[:: -1 if self._chance(0.5) else 1]
        skin: Json = {"joints": joints}
        if self._chance(0.9):
            inverse = np.stack([np.linalg.inv(self._worlds[j]).T.reshape(16) for j in joints])
            skin["inverseBindMatrices"] = self._file.add_accessor(inverse)
        return self._file.add("skins", skin)

    def _make_primitive(self, num_joints: int, num_targets: int) -> Json:
        random, file = self._random, self._file
        points, faces = _tube(self._unit)
        points = points + random.normal(size=points.shape) * 0.05 * self._unit
        attributes = {"POSITION": file.add_accessor(points, bounds=True)}
        if num_joints:
            joints, weights = _influences(random, len(points), num_joints)
            kind = str(random.choice(["f4", "u1", "u2"]))
            attributes["JOINTS_0"] = file.add_accessor(joints, "u1" if self._chance(0.5) else "u2")
            if kind != "f4":
                limit = {"u1": 255, "u2": 65535}[kind]
                weights = np.round(weights * limit)
                weights[:, 0] = limit - weights[:, 1:].sum(axis=1)
                weights /= limit
            attributes["WEIGHTS_0"] = file.add_accessor(weights, kind, normalized=kind != "f4")
        primitive: Json = {"attributes": attributes}
        if self._chance(0.8):
            primitive["indices"] = file.add_accessor(faces, "u2")
        if num_targets:
            moved = random.normal(size=(num_targets, *points.shape)) * 0.1 * self._unit
            primitive["targets"] = [{"POSITION": file.add_accessor(each, bounds=True)} for each in moved]
        return primitive


def _influences(random: np.random.Generator, count: int, num_joints: int) -> tuple[Any, Any]:
    """Joints and weights (V, 4); joints of weight 0 are 0."""
    joints = random.integers(0, num_joints, size=(count, 4))
    weights = random.random((count, 4)) * (random.random((count, 4)) < 0.6)
    weights[:, 0] += 0.01
    weights /= weights.sum(axis=1, keepdims=True)
    joints[weights == 0] = 0
    return joints, weights


def _matrix(node: Json) -> Any:
    found = np.eye(4)
    rotation = Rotation.from_quat(node.get("rotation", (0.0, 0.0, 0.0, 1.0))).as_matrix()
    found[:3, :3] = rotation * np.array(node.get("scale", (1.0, 1.0, 1.0)))
    found[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return found


def _tube(length: float) -> tuple[Any, Any]:
    """Points (V, 3) and corners of triangles along y."""
    angles = np.arange(SIDES) * 2 * np.pi / SIDES
    ring = 0.2 * length * np.stack([np.cos(angles), 0 * angles, np.sin(angles)], axis=1)
    points = np.concatenate([ring + np.array([0, length * k / (RINGS - 1), 0]) for k in range(RINGS)])
    corners = []
    for k in range(RINGS - 1):
        for a in range(SIDES):
            b, lower, upper = (a + 1) % SIDES, k * SIDES, (k + 1) * SIDES
            corners += [lower + a, upper + a, lower + b, lower + b, upper + a, upper + b]
    return points, np.array(corners)
