"""A plain player of GLB files by Appendix C of the specification: one time at a time, slerp by scipy, no `anim`."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from tests.fixtures.reading import decode, split

Floats = NDArray[np.float64]
REST = {"translation": (0.0, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0, 1.0), "scale": (1.0, 1.0, 1.0)}


class Channel(NamedTuple):
    """One animated property of a node: K key times, and as many rows of values, thrice as many for CUBICSPLINE."""

    node: int
    path: str
    interpolation: str
    times: Floats
    values: Floats


class Player:
    """One GLB."""

    def __init__(self, data: bytes) -> None:
        self.bytes = data
        self.document, self.blob = split(data)
        self.nodes: list[dict[str, Any]] = self.document.get("nodes", [])

    def names(self) -> list[str]:
        """The clips."""
        return [animation.get("name", "") for animation in self.document.get("animations", [])]

    def node(self, name: str) -> int:
        """Number of the node of this name."""
        return next(i for i, node in enumerate(self.nodes) if node.get("name") == name)

    def channels(self, clip: int) -> list[Channel]:
        """The channels of a clip that move nodes."""
        animation = self.document["animations"][clip]
        found = []
        for channel in animation["channels"]:
            sampler, target = animation["samplers"][channel["sampler"]], channel["target"]
            if "node" not in target:
                continue
            times = np.array(decode(self.document, self.blob, sampler["input"]), np.float64)
            values = np.array(decode(self.document, self.blob, sampler["output"]), np.float64)
            interpolation = sampler.get("interpolation", "LINEAR")
            rows = len(times) * (3 if interpolation == "CUBICSPLINE" else 1)
            found.append(Channel(target["node"], target["path"], interpolation, times, values.reshape(rows, -1)))
        return found

    def local(self, clip: int, time: float) -> list[dict[str, Floats]]:
        """Every node's translation, rotation, scale, and weights where they are animated."""
        poses = [{path: np.array(node.get(path, rest)) for path, rest in REST.items()} for node in self.nodes]
        for channel in self.channels(clip):
            poses[channel.node][channel.path] = value_at(channel, time)
        return poses

    def world(self, clip: int, time: float) -> Floats:
        """World matrices of all nodes (N, 4, 4)."""
        poses = self.local(clip, time)
        parents = {child: i for i, node in enumerate(self.nodes) for child in node.get("children", ())}

        def of(node: int) -> Floats:
            own = np.eye(4)
            own[:3, :3] = Rotation.from_quat(poses[node]["rotation"]).as_matrix() @ np.diag(poses[node]["scale"])
            own[:3, 3] = poses[node]["translation"]
            return of(parents[node]) @ own if node in parents else own

        return np.array([of(node) for node in range(len(self.nodes))])


def value_at(channel: Channel, time: float) -> Floats:
    """The property's value (C,) at a time in seconds: held before the first key and after the last."""
    times = channel.times
    is_cubic = channel.interpolation == "CUBICSPLINE"
    # In memory a key is one row of values, or three: in-tangents, values, out-tangents; so for weights too.
    keys = channel.values.reshape(len(times), 3 if is_cubic else 1, -1)
    values = keys[:, 1] if is_cubic else keys[:, 0]
    if time <= times[0] or len(times) == 1:
        return _unit(values[0], channel.path)
    if time >= times[-1]:
        return _unit(values[-1], channel.path)
    k = int(np.searchsorted(times, time, side="right")) - 1
    step = times[k + 1] - times[k]
    u = (time - times[k]) / step
    if channel.interpolation == "STEP":
        return _unit(values[k], channel.path)
    if is_cubic:
        value = (
            (2 * u**3 - 3 * u**2 + 1) * values[k]
            + step * (u**3 - 2 * u**2 + u) * keys[k, 2]
            + (-2 * u**3 + 3 * u**2) * values[k + 1]
            + step * (u**3 - u**2) * keys[k + 1, 0]
        )
        return _unit(value, channel.path)
    if channel.path == "rotation":
        turn = Slerp([0.0, 1.0], Rotation.from_quat(values[k : k + 2]))(u)
        quaternion: Floats = turn.as_quat()
        return quaternion
    linear: Floats = values[k] + u * (values[k + 1] - values[k])
    return linear


def _unit(value: Floats, path: str) -> Floats:
    unit: Floats = value / np.linalg.norm(value) if path == "rotation" else value
    return unit


def apart(path: str, one: Floats, other: Floats) -> float:
    """Largest difference of two values; quaternions of opposite sign are the same rotation."""
    difference = float(np.abs(one - other).max())
    return min(difference, float(np.abs(one + other).max())) if path == "rotation" else difference
