"""References that three.js fails on, and parts that no page shows: cameras, malformed lights and materials."""

from __future__ import annotations

from typing import Any

from anim.gltf.document import Json, json_array
from anim.show.page.embedded_names import LIGHTS, lights_of
from anim.units import plural

LIGHT_TYPES = ("directional", "point", "spot")


def drop_references(json: Json) -> list[str]:
    """Remove cameras, and references to missing materials and lights, in place; return notes about the latter."""
    json.pop("cameras", None)
    materials, lights = json_array(json, "materials"), lights_of(json)
    lost = 0
    for node in json_array(json, "nodes"):
        node.pop("camera", None)
        part = node.get("extensions", {}).get(LIGHTS)
        if part is not None and not _is_light(part, lights):
            del node["extensions"][LIGHTS]
            lost += 1
    for mesh in json_array(json, "meshes"):
        for primitive in mesh["primitives"]:
            if "material" in primitive and not _is_object(primitive["material"], materials):
                del primitive["material"]
                lost += 1
    return [f"{plural(lost, 'reference')} to missing materials or lights left out"] if lost else []


def _is_light(part: Any, lights: list[Any]) -> bool:
    index = part.get("light") if isinstance(part, dict) else None
    if type(index) is not int or not _is_object(index, lights):
        return False
    return lights[index].get("type") in LIGHT_TYPES and isinstance(lights[index].get("spot", {}), dict)


def _is_object(index: Any, objects: list[Any]) -> bool:
    return type(index) is int and 0 <= index < len(objects) and isinstance(objects[index], dict)
