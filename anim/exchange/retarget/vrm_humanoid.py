"""Human joint roles stated by VRM files: VRM 0.x, VRM 1.0 and VRM animations."""

from __future__ import annotations

import re
from typing import Any

from anim.gltf.document import Json, json_array

EXTENSIONS = ("VRMC_vrm", "VRMC_vrm_animation", "VRM")
ROLES = {"left_toes": "left_toe", "right_toes": "right_toe"}  # different names in VRM


def read_vrm_roles(json: Json) -> dict[str, int]:
    """Return the nodes by role ("left_upper_arm", see `joint_roles`) of a file's extensions.

    Of VRM 1.0 and animations humanBones is an object of {"node": 3} by bone; of VRM 0.x a list of {"bone", "node"}. An
    upper chest is the chest if no chest is stated. Invalid entries are ignored.
    {"leftToes": {"node": 7}} → {"left_toe": 7}
    """
    count = len(json_array(json, "nodes"))
    extensions = json.get("extensions")
    for name in EXTENSIONS:
        bones = _lookup(_lookup(_lookup(extensions, name), "humanoid"), "humanBones")
        each = (
            bones.items()
            if isinstance(bones, dict)
            else ((_lookup(b, "bone"), b) for b in (bones if isinstance(bones, list) else ()))
        )
        found = {_role(bone): _lookup(about, "node") for bone, about in each if isinstance(bone, str)}
        nodes = {role: node for role, node in found.items() if type(node) is int and 0 <= node < count}
        if nodes:
            upper = nodes.pop("upper_chest", None)
            return nodes if upper is None or "chest" in nodes else {**nodes, "chest": upper}
    return {}


def _lookup(value: Any, key: str) -> Any:
    return value.get(key) if isinstance(value, dict) else None


def _role(bone: str) -> str:
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", bone).lower()
    return ROLES.get(words, words)
