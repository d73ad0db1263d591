"""Values of properties that only the clip of another file animates: colors, factors, and other JSON pointers."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from anim.arrays import Floats
from anim.gltf.document import Json
from anim.model import Clip, Interpolation, Track, parse_weight_pointer

# Of properties that a file leaves out, in each component (glTF 2.0 and the extensions' specifications).
DEFAULTS = {
    "alphaCutoff": 0.5,
    "anisotropyRotation": 0.0,
    "anisotropyStrength": 0.0,
    "attenuationColor": 1.0,
    "baseColorFactor": 1.0,
    "clearcoatFactor": 0.0,
    "clearcoatRoughnessFactor": 0.0,
    "color": 1.0,
    "diffuseFactor": 1.0,
    "dispersion": 0.0,
    "emissiveFactor": 0.0,
    "emissiveStrength": 1.0,
    "glossinessFactor": 1.0,
    "innerConeAngle": 0.0,
    "intensity": 1.0,
    "ior": 1.5,
    "iridescenceFactor": 0.0,
    "iridescenceIor": 1.3,
    "iridescenceThicknessMaximum": 400.0,
    "iridescenceThicknessMinimum": 100.0,
    "metallicFactor": 1.0,
    "offset": 0.0,
    "outerConeAngle": np.pi / 4,
    "rotation": 0.0,
    "roughnessFactor": 1.0,
    "scale": 1.0,
    "sheenColorFactor": 0.0,
    "sheenRoughnessFactor": 0.0,
    "specularColorFactor": 1.0,
    "specularFactor": 1.0,
    "strength": 1.0,
    "thicknessFactor": 0.0,
    "transmissionFactor": 0.0,
    "visible": 1.0,
}

MAX_SINGLE = float(np.finfo(np.float32).max)


def add_static_pointers(clip: Clip, other: Clip, json: Json | None) -> tuple[Clip, tuple[str, ...]]:
    """Return the clip with constant tracks of the pointers that only `other` animates, and those without a known value.

    json: of the clip's file, which has the values; None: no value is known. Morph weights are no such pointers.
    """
    own = {track.pointer for track in clip.tracks}
    lacking = [track for track in other.tracks if _is_property(track) and track.pointer not in own]
    values = [None if json is None else _value(json, track) for track in lacking]
    known = [_constant(track, value) for track, value in zip(lacking, values, strict=True) if value is not None]
    unknown = (track.pointer or "" for track, value in zip(lacking, values, strict=True) if value is None)
    return (Clip(clip.name, (*clip.tracks, *known)) if known else clip), tuple(unknown)


def _is_property(track: Track) -> bool:
    return track.path == "pointer" and parse_weight_pointer(track.pointer) is None


def _constant(track: Track, value: Floats) -> Track:
    stored = value.astype(np.float32).astype(np.float64)  # as the keys of a track are
    return Track(None, "pointer", Interpolation.STEP, track.times[:1], stored[None], pointer=track.pointer)


def _value(json: Json, track: Track) -> Floats | None:
    """Value (C,) of the track's property in the file, by default that of the specification; None if there is none."""
    count = track.values.shape[1]
    names = [name.replace("~1", "/").replace("~0", "~") for name in (track.pointer or "").split("/")[1:]]
    found: Any = json
    for depth, name in enumerate(names):
        if isinstance(found, list) and name.isdecimal() and int(name) < len(found):
            found = found[int(name)]
        elif isinstance(found, dict) and name in found:
            found = found[name]
        else:
            is_object = isinstance(found, dict) and depth > 1  # of an array's element that the file has
            default = DEFAULTS.get(names[-1]) if is_object and _has_defaults(names) else None
            return None if default is None else np.full(count, default)
    numbers = found if isinstance(found, list) else [found]
    if len(numbers) != count or not all(isinstance(each, (int, float)) and abs(each) <= MAX_SINGLE for each in numbers):
        return None
    return np.array(numbers, np.float64)


def _has_defaults(names: list[str]) -> bool:
    """Return whether a property is of glTF or of a Khronos extension: others have defaults of their own."""
    extensions = [after for name, after in pairwise(names) if name == "extensions"]
    return all(each.startswith("KHR_") for each in extensions)
