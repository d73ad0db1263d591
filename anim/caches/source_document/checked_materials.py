"""Materials of a source document whose properties have the types of the glTF specification."""

from __future__ import annotations

from anim.errors import FormatError
from anim.gltf.document import Json, json_array
from anim.gltf.reading.materials import TRANSFORM
from anim.gltf.validation.rules import ObjectRule, at_least, number, numbers, text

EMISSIVE_STRENGTH = "KHR_materials_emissive_strength"

_TRANSFORM = ObjectRule({"offset": numbers(2), "rotation": number, "scale": numbers(2), "texCoord": at_least(0)})
_TEXTURE_INFO = ObjectRule(
    {
        "index": at_least(0),
        "texCoord": at_least(0),
        "scale": number,
        "strength": number,
        "extensions": ObjectRule({TRANSFORM: _TRANSFORM}),
    }
)
_SURFACE = ObjectRule(
    {
        "baseColorFactor": numbers(4),
        "metallicFactor": number,
        "roughnessFactor": number,
        "baseColorTexture": _TEXTURE_INFO,
        "metallicRoughnessTexture": _TEXTURE_INFO,
    }
)
_MATERIAL = ObjectRule(
    {
        "name": text,
        "pbrMetallicRoughness": _SURFACE,
        "normalTexture": _TEXTURE_INFO,
        "occlusionTexture": _TEXTURE_INFO,
        "emissiveTexture": _TEXTURE_INFO,
        "emissiveFactor": numbers(3),
        "alphaMode": text,
        "alphaCutoff": number,
        "extensions": ObjectRule({EMISSIVE_STRENGTH: ObjectRule({"emissiveStrength": number})}),
    }
)


def find_item(json: Json, key: str, index: object) -> Json:
    """Return an object of a top-level array, {} for an index that the file does not have."""
    found = json_array(json, key)
    item = found[index] if type(index) is int and 0 <= index < len(found) else {}
    return item if isinstance(item, dict) else {}


def find_material(json: Json, index: object) -> Json:
    """Return a material, {} for an index that the file does not have.

    index: None for a primitive without one. Raises FormatError for properties of other types than the specification's.
    """
    if index is not None and type(index) is not int:
        raise FormatError(f"a primitive's material is {repr(index)[:60]} (expected a whole number)")
    found = find_item(json, "materials", index)
    try:
        _MATERIAL(found)
    except FormatError as error:
        raise error.at(f"material {index}", ": ") from None
    return found
