"""Body roles of joints, by name or by the humanoid of a VRM."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from anim.exchange.retarget.joint_names import JointName
from anim.gltf.document import Json, json_array

# Stems by role, the most certain first: CMU, Mixamo, Biped (3ds Max), Rigify, Unreal, VRM, Poser, KayKit, Quaternius,
# Daz; last Rigify's own names, with a spine that begins at the hips, as in skeletons with numbered spines.
MIDDLE = {
    "hips": ("hips", "pelvis", "hip", "spine", "spine1"),
    "spine": ("spine", "spine1", "abdomen", "abdomenlower", "lowerback", "waist", "torso"),
    "chest": ("chest", "upperchest", "spine3", "spine2", "spine1", "chestlower", "thorax", "ribcage", "torso"),
    "neck": ("neck", "neck1", "necklower", "spine4"),
    "head": ("head", "head1", "spine6"),
}
SIDED = {
    "shoulder": ("shoulder", "collar", "clavicle", "collarbone"),
    "upper_arm": ("upperarm", "uparm", "arm", "shldr", "shldrbend", "armupper", "armupper1", "bicep"),
    "lower_arm": ("lowerarm", "lowarm", "forearm", "forearmbend", "elbow", "armlower", "armlower1"),
    "hand": ("hand", "hand1", "wrist"),
    "upper_leg": ("upperleg", "upleg", "thigh", "thighbend", "hip", "legupper", "legupper1"),
    "lower_leg": ("lowerleg", "lowleg", "leg", "shin", "calf", "knee", "leglower", "leglower1"),
    "foot": ("foot", "foot1", "ankle"),
    "toe": ("toes", "toe", "toebase", "ball", "toe0", "foot2"),
}
PERSON = ("hips", "left_upper_leg", "right_upper_leg", "left_foot", "right_foot")
EXTENSIONS = ("VRMC_vrm", "VRMC_vrm_animation", "VRM")
ROLES = {"left_toes": "left_toe", "right_toes": "right_toe"}  # different names in VRM


def joint_roles(names: Sequence[JointName], chosen: Sequence[int]) -> dict[str, int]:
    """Return the nodes by role ("left_upper_arm") of `chosen`; each node at most once.

    CMU's names → {"hips": 0, "left_upper_leg": 2, …}
    """
    found: dict[str, int] = {}
    taken: set[int] = set()
    wanted = [(role, "", stems) for role, stems in MIDDLE.items()]
    wanted += [(role, side, stems) for side in ("left", "right") for role, stems in SIDED.items()]
    by_name: dict[JointName, int] = {}
    for node in chosen:
        by_name.setdefault(names[node], node)
    for role, side, stems in wanted:
        for stem in stems:
            node = by_name.get(JointName(side, stem), -1)
            if node >= 0 and node not in taken:
                found[f"{side}_{role}" if side else role] = node
                taken.add(node)
                break
    return found


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
