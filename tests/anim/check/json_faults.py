"""Edits of a JSON that break rules, each one of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tests.files import opened_fixture

Json = dict[str, Any]
Edit = Callable[[Json], None]
ARM_JOINTS: list[int] = opened_fixture("arm").json["skins"][0]["joints"]
FOOT = ARM_JOINTS[-1]


def put(path: str, value: Any) -> Edit:
    """Return an edit that sets a property by its JSON pointer; None removes it."""

    def edit(json: dict[str, Any]) -> None:
        *parts, last = path.strip("/").split("/")
        at: Any = json
        for part in parts:
            at = at[int(part)] if isinstance(at, list) else at.setdefault(part, {})
        if value is None:
            del at[last]
        else:
            at[int(last) if isinstance(at, list) else last] = value

    return edit


def other_root(json: dict[str, Any]) -> None:
    """Animate a node that is in no scene."""
    json["nodes"].append({"name": "lost"})
    for channel in json["animations"][0]["channels"]:
        channel["target"] = {"node": len(json["nodes"]) - 1, "path": channel["target"]["path"]}
    json["animations"][0]["channels"] = json["animations"][0]["channels"][:1]


def joints_apart(json: dict[str, Any]) -> None:
    """Leave the joints out of the scene that shows their skin."""
    for node in json["nodes"]:
        if "skin" in node:
            node.pop("children", None)
    json["scenes"][0]["nodes"] = [i for i, node in enumerate(json["nodes"]) if "skin" in node]


def same_names(json: dict[str, Any]) -> None:
    for node in json["nodes"]:
        node["name"] = "bone"


def scale_above(json: dict[str, Any]) -> None:
    joints = json["skins"][0]["joints"]
    json["nodes"].append({"name": "Armature", "scale": [0.01, 0.01, 0.01], "children": [joints[0]]})
    for scene in json["scenes"]:
        scene["nodes"] = [len(json["nodes"]) - 1 if node == joints[0] else node for node in scene["nodes"]]


def second_skin(json: dict[str, Any]) -> None:
    json["skins"].append(json["skins"][0])


def move_mesh(json: dict[str, Any]) -> None:
    next(node for node in json["nodes"] if "skin" in node)["translation"] = [0.0, 1.0, 0.0]


def pointer_at_node(json: dict[str, Any]) -> None:
    channel = json["animations"][0]["channels"][0]
    address = f"/nodes/{channel['target']['node']}/{channel['target']['path']}"
    channel["target"] = {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": address}}}


def declared_pointer(json: dict[str, Any]) -> None:
    pointer_at_node(json)
    json["extensionsUsed"] = ["KHR_animation_pointer"]


def equal_names(json: Json) -> None:
    for clip in json["animations"]:
        clip["name"] = "walk"


def wrong_type(json: Json) -> None:
    json["accessors"].append({"componentType": 5126, "count": 1, "type": "VEC9"})


def unused_sampler(json: Json) -> None:
    json["animations"][0]["samplers"].append(dict(json["animations"][0]["samplers"][0]))


def without_bounds(json: Json) -> None:
    for sampler in json["animations"][0]["samplers"]:
        for key in ("min", "max"):
            json["accessors"][sampler["input"]].pop(key, None)


def with_strides(json: Json) -> None:
    sizes = {"SCALAR": 4, "VEC3": 12, "VEC4": 16}
    for sampler in json["animations"][0]["samplers"]:
        output = json["accessors"][sampler["output"]]
        json["bufferViews"][output["bufferView"]]["byteStride"] = sizes[output["type"]]


def with_matrix(json: Json) -> None:
    node = json["nodes"][json["animations"][0]["channels"][0]["target"]["node"]]
    for key in ("translation", "rotation", "scale"):
        node.pop(key, None)
    node["matrix"] = np.eye(4).ravel().tolist()


def without_joints(json: Json) -> None:
    del json["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"]


def apart(json: Json) -> None:
    """Take the last joint out of the hierarchy of the others."""
    last = json["skins"][0]["joints"][-1]
    for node in json["nodes"]:
        if last in node.get("children", ()):
            node["children"].remove(last)
            if not node["children"]:
                del node["children"]
    json["scenes"][0]["nodes"].append(last)


def wrong_hint(json: Json) -> None:
    json["skins"][0]["skeleton"] = json["skins"][0]["joints"][-1]


def strided_matrices(json: Json) -> None:
    accessor = json["accessors"][json["skins"][0]["inverseBindMatrices"]]
    json["bufferViews"][accessor["bufferView"]]["byteStride"] = 64


def idle_joint(json: Json) -> None:
    skin = json["skins"][0]
    json["nodes"].append({"name": "idle"})
    json["nodes"][skin["joints"][-1]].setdefault("children", []).append(len(json["nodes"]) - 1)
    skin["joints"].append(len(json["nodes"]) - 1)
    del skin["inverseBindMatrices"]
