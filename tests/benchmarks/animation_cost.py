"""What the animations of a file cost: the same sum for our files and for those of others.

data: bytes as stored of the buffer views that only animations use (compressed where they are), and of their accessors
in views that others use too. json: what the minified JSON would lose with the animations, their accessors and their
views. A compression that animations use is charged with its declaration and its fallback buffer, also where meshes
share it.
"""

from __future__ import annotations

import json as jsonlib
from dataclasses import dataclass
from pathlib import Path

from anim.gltf.document import Json, json_array
from anim.gltf.validation import buffer_layout
from anim.gltf.writing import references
from tests.files import opened_path


@dataclass(frozen=True, slots=True)
class Cost:
    """Bytes of stored numbers, and of the JSON that describes them."""

    data: int
    json: int

    @property
    def total(self) -> int:
        """Both together."""
        return self.data + self.json


def animation_cost(path: Path) -> Cost:
    """Return what the animations of a .glb or .gltf cost; 0 and 0 of a file without any."""
    content = opened_path(path).json
    accessors, views = json_array(content, "accessors"), json_array(content, "bufferViews")
    gone = _of_animations(content) - _of_others(content)
    kept = {view for i, each in enumerate(accessors) if i not in gone for view in references.views_of(each)}
    kept |= {image["bufferView"] for image in json_array(content, "images") if "bufferView" in image}
    dropped = {view for i in gone for view in references.views_of(accessors[i])} - kept
    data = sum(_stored(views[view]) for view in dropped)
    data += sum(_size(accessors[i]) for i in gone if not dropped.issuperset(references.views_of(accessors[i])))
    rest = {key: value for key, value in content.items() if key != "animations"}
    rest["accessors"] = [each for i, each in enumerate(accessors) if i not in gone]
    rest["bufferViews"] = [each for i, each in enumerate(views) if i not in dropped]
    text = _length(content) - _length(rest) if gone else 0
    return Cost(data, text + _declarations(content, [views[view] for view in dropped]))


def _of_animations(content: Json) -> set[int]:
    samplers = [sampler for clip in json_array(content, "animations") for sampler in clip["samplers"]]
    return {sampler[end] for sampler in samplers for end in ("input", "output")}


def _of_others(content: Json) -> set[int]:
    """Accessors of meshes, skins and instances: all that the format has, besides animations."""
    found = {skin["inverseBindMatrices"] for skin in json_array(content, "skins") if "inverseBindMatrices" in skin}
    for primitive in (each for mesh in json_array(content, "meshes") for each in mesh["primitives"]):
        found |= {each for target in primitive.get("targets", ()) for each in target.values()}
        found |= {*primitive["attributes"].values(), primitive.get("indices", -1)}
    for node in json_array(content, "nodes"):
        found |= set(node.get("extensions", {}).get("EXT_mesh_gpu_instancing", {}).get("attributes", {}).values())
    return found


def _stored(view: Json) -> int:
    return int((buffer_layout.compression(view) or view)["byteLength"])


def _size(accessor: Json) -> int:
    return int(accessor["count"]) * buffer_layout.element_size(accessor["componentType"], accessor["type"])


def _declarations(content: Json, views: list[Json]) -> int:
    """What the extensions that these views use need besides: their names, and the buffers that stand in for them."""
    used = {name for view in views for name in view.get("extensions", {})}
    names = [name for key in ("extensionsUsed", "extensionsRequired") for name in content.get(key, ()) if name in used]
    buffers = json_array(content, "buffers")
    stand_ins = {view["buffer"] for view in views if buffer_layout.compression(view)}
    fallback = [buffers[i] for i in stand_ins if used & set(buffers[i].get("extensions", {}))]
    return sum(_length(each) + 1 for each in [*names, *fallback])


def _length(part: object) -> int:
    return len(jsonlib.dumps(part, separators=(",", ":"), ensure_ascii=False).encode())
