"""Validate the JSON by glTF's schema once on reading, so that later code needs no checks.

Only properties used by animation, skinning and buffers are checked, and only ambiguous faults: an empty array, a wrong
min/max or an unknown property is harmless and left to `inspect`'s findings.
"""

from __future__ import annotations

from anim.errors import FormatError
from anim.gltf.document import Json
from anim.gltf.validation import buffer_layout, channel_targets, hierarchy
from anim.gltf.validation.rules import check_items, check_property, list_of, of_type, text
from anim.gltf.validation.schema import rules

TOP_ARRAYS = frozenset(
    """
    accessors animations buffers bufferViews cameras images materials meshes nodes samplers scenes skins textures
    """.split()  # noqa: SIM905 (a list of one name per line would hide the words)
)


def validate(json: Json) -> None:
    """Raise FormatError, with a JSON path, at the first violation of glTF 2.0."""
    for key in TOP_ARRAYS:
        of_type(json.get(key, []), list, "an array", key)
    counts = {key: len(json.get(key, [])) for key in TOP_ARRAYS}
    checks = rules(counts)
    if "asset" not in json:
        raise FormatError("has no 'asset' (every glTF names its version there)")
    check_property("asset", checks.pop("asset"), json["asset"])
    for key in ("extensionsUsed", "extensionsRequired"):
        check_property(key, list_of(text), json.get(key, []))
    for key, check_one in checks.items():
        check_items(json.get(key, []), check_one, key)
    buffer_layout.check(json)
    hierarchy.check(json)
    channel_targets.check(json)
