"""Vertices of a GLB by the text of the specification: a reader of its own, in float64, of nothing but numpy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.fixtures.reading import split

Array = NDArray[np.float64]
Key = tuple[str, int, str]  # owner ("nodes" or "meshes"), index, property: "weights/1" for one weight

DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
LARGEST = {5120: 127.0, 5121: 255.0, 5122: 32767.0, 5123: 65535.0}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
DEFAULTS = {"translation": (0.0, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0, 1.0), "scale": (1.0, 1.0, 1.0)}
SMALL_ANGLE_RAD = 1e-7


class Evaluator:
    """Poses and vertices of a GLB at times."""

    def __init__(self, path: str) -> None:
        self._json, self._blob = split(Path(path).read_bytes())
        self._nodes = self._json["nodes"]
        self._parents = {child: i for i, node in enumerate(self._nodes) for child in node.get("children", [])}

    @property
    def num_clips(self) -> int:
        """Number of clips."""
        return len(self._json.get("animations", []))

    def accessor(self, index: int) -> Array:
        """Elements (count, C) of an accessor, normalized ones as fractions."""
        about = self._json["accessors"][index]
        assert "sparse" not in about
        count, width, kind = about["count"], WIDTHS[about["type"]], about["componentType"]
        if "bufferView" not in about:
            return np.zeros((count, width))
        view = self._json["bufferViews"][about["bufferView"]]
        dtype = np.dtype(DTYPES[kind])
        size = dtype.itemsize * width
        start, stride = view.get("byteOffset", 0) + about.get("byteOffset", 0), view.get("byteStride", size)
        rows = [np.frombuffer(self._blob, dtype, width, start + i * stride) for i in range(count)]
        values = np.array(rows, np.float64).reshape(count, width)
        return np.maximum(values / LARGEST[kind], -1.0) if about.get("normalized") else values

    def key_times(self, clip: int, kinds: tuple[str, ...] = ("STEP", "LINEAR", "CUBICSPLINE")) -> Array:
        """Key times of a clip's samplers of these kinds, sorted."""
        samplers = self._json["animations"][clip]["samplers"]
        used = [each for each in samplers if each.get("interpolation", "LINEAR") in kinds]
        found = [self.accessor(each["input"])[:, 0] for each in used]
        return np.unique(np.concatenate(found)) if found else np.empty(0)

    def worlds(self, clip: int | None, times: Array, *, nlerp: bool = False) -> list[Array]:
        """World matrices (T, 4, 4) of all nodes. clip: None for the pose at rest."""
        return self._worlds(self._animated(clip, times, nlerp), len(times))

    def vertices(self, clip: int | None, times: Array, *, nlerp: bool = False) -> dict[int, Array]:
        """Vertices (T, V, 3) of all primitives of each node with a mesh, depth first.

        nlerp: rotations as many players compute them.
        """
        animated = self._animated(clip, times, nlerp)
        worlds = self._worlds(animated, len(times))
        found = {}
        for i in self._depth_first():
            if "mesh" in self._nodes[i]:
                weights = self._weights(i, animated, len(times))
                parts = self._json["meshes"][self._nodes[i]["mesh"]]["primitives"]
                found[i] = np.concatenate([self._primitive(i, each, weights, worlds) for each in parts], axis=1)
        return found

    def _depth_first(self) -> list[int]:
        waiting = [root for scene in self._json["scenes"] for root in scene["nodes"]][::-1]
        found = []
        while waiting:
            found.append(waiting.pop())
            waiting += reversed(self._nodes[found[-1]].get("children", []))
        return found

    def _animated(self, clip: int | None, times: Array, nlerp: bool) -> dict[Key, Array]:
        """Values (T, C) of everything that the clip moves."""
        found: dict[Key, Array] = {}
        if clip is None:
            return found
        animation = self._json["animations"][clip]
        for channel in animation["channels"]:
            key = _key(channel["target"])
            if key is not None:
                sampler = animation["samplers"][channel["sampler"]]
                found[key] = self._sample(sampler, times, is_rotation=key[2] == "rotation", nlerp=nlerp)
        return found

    def _sample(self, sampler: dict[str, Any], times: Array, *, is_rotation: bool, nlerp: bool) -> Array:
        keys, kind = self.accessor(sampler["input"])[:, 0], sampler.get("interpolation", "LINEAR")
        spline = kind == "CUBICSPLINE"
        stored = self.accessor(sampler["output"])
        values = stored.reshape(len(keys), 3, -1) if spline else stored.reshape(len(keys), -1)
        at = values[:, 1] if spline else values
        unit = _normalize if is_rotation else np.asarray
        if len(keys) == 1:
            return np.repeat(unit(at), len(times), axis=0)
        k = np.clip(np.searchsorted(keys, times, "right") - 1, 0, len(keys) - 2)
        length = (keys[k + 1] - keys[k])[:, None]
        u = np.clip((times - keys[k])[:, None] / length, 0.0, 1.0)
        if kind == "STEP":
            return unit(at[np.clip(np.searchsorted(keys, times, "right") - 1, 0, len(keys) - 1)])
        if spline:
            leaving, arriving = values[k, 2] * length, values[k + 1, 0] * length
            a, b = (2 * u**3 - 3 * u**2 + 1) * at[k], (3 * u**2 - 2 * u**3) * at[k + 1]
            return unit(a + (u**3 - 2 * u**2 + u) * leaving + b + (u**3 - u**2) * arriving)
        return (_slerp(at[k], at[k + 1], u, nlerp)) if is_rotation else at[k] + (at[k + 1] - at[k]) * u

    def _weights(self, node: int, animated: dict[Key, Array], count: int) -> Array:
        """Morph weights (T, M) of a node: its mesh's, unless it has its own; then single ones."""
        own = self._nodes[node]
        mesh = self._json["meshes"][own["mesh"]]
        size = len(mesh["primitives"][0].get("targets", []))
        found = np.tile(np.array(own.get("weights", mesh.get("weights", [0.0] * size)), np.float64), (count, 1))
        chain = [("nodes", node)]
        if "weights" not in own and ("nodes", node, "weights") not in animated:
            chain = [("meshes", own["mesh"]), *chain]
        for owner, index in chain:
            found = animated.get((owner, index, "weights"), found).copy()
            for i in range(size):
                if (owner, index, f"weights/{i}") in animated:
                    found[:, i] = animated[owner, index, f"weights/{i}"][:, 0]
        return found

    def _worlds(self, animated: dict[Key, Array], count: int) -> list[Array]:
        made: dict[int, Array] = {}

        def world(i: int) -> Array:
            if i not in made:
                own = self._local(i, animated, count)
                made[i] = world(self._parents[i]) @ own if i in self._parents else own
            return made[i]

        return [world(i) for i in range(len(self._nodes))]

    def _local(self, i: int, animated: dict[Key, Array], count: int) -> Array:
        node = self._nodes[i]
        if "matrix" in node:
            return np.tile(np.array(node["matrix"], np.float64).reshape(4, 4).T, (count, 1, 1))
        translation, rotation, scale = (
            animated.get(("nodes", i, path), np.tile(np.array(node.get(path, default), np.float64), (count, 1)))
            for path, default in DEFAULTS.items()
        )
        found = np.zeros((count, 4, 4))
        found[:, :3, :3] = _rotation_matrix(rotation) * scale[:, None]
        found[:, :3, 3] = translation
        found[:, 3, 3] = 1.0
        return found

    def _primitive(self, i: int, primitive: dict[str, Any], weights: Array, worlds: list[Array]) -> Array:
        node, attributes = self._nodes[i], primitive["attributes"]
        points = np.tile(self.accessor(attributes["POSITION"]), (len(weights), 1, 1))
        for k, target in enumerate(primitive.get("targets", [])):
            if "POSITION" in target:
                points = points + weights[:, k, None, None] * self.accessor(target["POSITION"])
        if "skin" not in node or "JOINTS_0" not in attributes:
            return points @ worlds[i][:, :3, :3].transpose(0, 2, 1) + worlds[i][:, None, :3, 3]
        skin = self._json["skins"][node["skin"]]
        inverse = np.tile(np.eye(4), (len(skin["joints"]), 1, 1))
        if "inverseBindMatrices" in skin:
            inverse = self.accessor(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
        joints = np.stack([worlds[j] @ inverse[k] for k, j in enumerate(skin["joints"])], axis=1)
        used = self.accessor(attributes["JOINTS_0"]).astype(np.int64)
        shares = self.accessor(attributes["WEIGHTS_0"])
        shares = shares / shares.sum(axis=1, keepdims=True)
        blended = np.einsum("vi,tviab->tvab", shares, joints[:, used])
        return np.asarray(np.einsum("tvab,tvb->tva", blended[..., :3, :3], points) + blended[..., :3, 3])


def _key(target: dict[str, Any]) -> Key | None:
    if target["path"] != "pointer":
        return ("nodes", target["node"], target["path"]) if "node" in target else None
    _, owner, index, *path = target["extensions"]["KHR_animation_pointer"]["pointer"].split("/")
    return (owner, int(index), "/".join(path)) if owner in ("nodes", "meshes") else None


def _normalize(rotations: Array) -> Array:
    return np.asarray(rotations / np.linalg.norm(rotations, axis=-1, keepdims=True))


def _slerp(a: Array, b: Array, u: Array, nlerp: bool) -> Array:
    a, b = (a, b) if nlerp else (_normalize(a), _normalize(b))
    dot = (a * b).sum(axis=1, keepdims=True)
    b = np.where(dot < 0, -b, b)
    angle = np.arccos(np.minimum(np.abs(dot), 1.0))
    sine = np.sin(angle)
    is_curved = sine > (2.0 if nlerp else SMALL_ANGLE_RAD)
    sine = np.where(is_curved, sine, 1.0)
    arc = (np.sin((1 - u) * angle) * a + np.sin(u * angle) * b) / sine
    return _normalize(np.where(is_curved, arc, a + (b - a) * u))


def _rotation_matrix(rotations: Array) -> Array:
    x, y, z, w = np.moveaxis(_normalize(rotations), -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
