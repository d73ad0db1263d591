"""Names and shared meshes that three.js takes for one: it finds the target of a track by its object's name."""

from __future__ import annotations

import re
from collections import Counter
from itertools import count
from typing import Any

from anim.gltf.document import Json, json_array

LIGHTS = "KHR_lights_punctual"
_SPACE = re.compile("[\t\n\v\f\r \u00a0\u1680\u2000-\u200a\u2028\u2029\u202f\u205f\u3000\ufeff]")  # \s in JavaScript
_RESERVED = re.compile(r"[\[\].:/]")
# Names that every object in JavaScript has; three.js counts uses of a name in an object, and gets NaN for these
_INHERITED = frozenset(
    """
    __defineGetter__ __defineSetter__ __lookupGetter__ __lookupSetter__ __proto__ constructor hasOwnProperty
    isPrototypeOf propertyIsEnumerable toLocaleString toString valueOf
    """.split()  # noqa: SIM905 (one name per line would hide the words)
)


def separate_meshes(json: Json) -> None:
    """Give nodes copies of meshes that three.js can't share, in place. Copies have the same accessors.

    It animates only the weights of the first node with a mesh of morph targets and several primitives, and fails on a
    node without a skin if another node has the same mesh with one.
    """
    _separate_skinned(json)
    meshes, used = json_array(json, "meshes"), set[int]()
    for node in json_array(json, "nodes"):
        mesh = node.get("mesh")
        if mesh is None or len(meshes[mesh]["primitives"]) < 2 or not meshes[mesh]["primitives"][0].get("targets"):
            continue
        if mesh in used:
            meshes.append(dict(meshes[mesh]))
            node["mesh"] = len(meshes) - 1
        used.add(mesh)


def _separate_skinned(json: Json) -> None:
    """Give nodes without a skin a copy of a mesh that another node has with a skin, one for all of them."""
    meshes, nodes = json_array(json, "meshes"), json_array(json, "nodes")
    skinned = {node["mesh"] for node in nodes if "skin" in node and "mesh" in node}
    copies: dict[int, int] = {}
    for node in nodes:
        if "skin" in node or node.get("mesh") not in skinned:
            continue
        mesh = node["mesh"]
        if mesh not in copies:
            copies[mesh] = len(meshes)
            meshes.append(dict(meshes[mesh]))
        node["mesh"] = copies[mesh]


def separate_names(json: Json) -> list[str]:
    """Change names that three.js would give to two objects, in place; return a note about them.

    It strips reserved characters, and appends _1 to the second "arm", without regard to another node "arm_1".
    """
    for each in (*json_array(json, "scenes"), *lights_of(json)):
        if isinstance(each, dict) and not _name(each):  # invalid: three.js fails on what is no text
            each.pop("name", None)
    holders = _holders(json)
    counts = Counter(sanitize(name) for _, name in holders)
    risky = {
        name
        for name, number in counts.items()
        if name in _INHERITED or any(f"{name}_{i}" in counts for i in range(1, number))
    }
    changed = 0
    for i, (holder, name) in enumerate(holders):
        if sanitize(name) in risky and holder is not None:
            holder["name"] = next(new for k in count(i) if sanitize(new := f"{name} #{k}") not in counts)
            counts[sanitize(holder["name"])] += 1
            changed += 1
    return [f"{changed} names changed, which three.js takes for one"] if changed else []


def sanitize(name: str) -> str:
    """Return a name as three.js changes it: without reserved characters, and spaces as underscores."""
    return _RESERVED.sub("", _SPACE.sub("_", name))


def _holders(json: Json) -> list[tuple[Json | None, str]]:
    """Objects with a name in three.js, and the name; None instead of a second object of the same JSON."""
    found: list[tuple[Json | None, str]] = []
    for key in ("nodes", "scenes"):
        found += [(each, each["name"]) for each in json_array(json, key) if _name(each)]
    for kind, objects in (("mesh", json_array(json, "meshes")), ("light", lights_of(json))):
        for i, each in enumerate(objects):
            if not isinstance(each, dict):
                continue
            own = _name(each) or f"{kind}_{i}"
            found.append((each, own))
            found += [(None, own)] * (len(each.get("primitives", ())) - 1)
    return found


def lights_of(json: Json) -> list[Any]:
    """Return the lights of KHR_lights_punctual, none if it is malformed."""
    part: Any = json
    for key in ("extensions", LIGHTS, "lights"):
        part = part.get(key) if isinstance(part, dict) else None
    return part if isinstance(part, list) else []


def _name(about: Any) -> str:
    name = about.get("name") if isinstance(about, dict) else None
    return name if isinstance(name, str) else ""
