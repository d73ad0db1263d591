"""Engine presets of textures: permuted, negated and scaled axes, and the engine's row order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import AnyArray
from anim.errors import RangeError


@dataclass(frozen=True, slots=True)
class Preset:
    """One engine.

    axes: indices of glTF's axes (0, 1, 2) for its x, y, z; signs: ±1 for each. per_meter: its units per metre.
    is_flipped: True if v counts from the bottom row after the engine's own loader.
    endings: extensions of lossless formats. advice: settings for the user, a line each. coordinate_sets: largest number
    of sets of texture coordinates of a mesh. supported_sets: number of sets that its importer supports completely.
    """

    axes: tuple[int, int, int]
    signs: tuple[int, int, int]
    per_meter: float
    is_flipped: bool
    endings: tuple[str, ...]
    advice: tuple[str, ...] = ()
    coordinate_sets: int = 8
    supported_sets: int = 8


NEAREST = "nearest filter, no mipmaps, no compression, no sRGB"
LIGHTMAPS = (
    "Light Baking: not Static Lightmaps, which replaces the second set of coordinates; no LODs, no shadow meshes"
)
PRESETS = {
    "plain": Preset((0, 1, 2), (1, 1, 1), 1.0, False, (".exr", ".png"), (f"axes of glTF, v from the top; {NEAREST}",)),
    "three": Preset(  # EXRLoader flips the rows
        (0, 1, 2), (1, 1, 1), 1.0, True, (".exr",), (f"EXRLoader, FloatType or HalfFloatType; {NEAREST}",)
    ),
    "godot": Preset((0, 1, 2), (1, 1, 1), 1.0, False, (".exr",), (f"import as lossless; {NEAREST}", LIGHTMAPS), 2),
    "unity": Preset(
        (0, 1, 2), (-1, 1, 1), 1.0, False, (".exr", ".png"), (f"mesh through glTFast; {NEAREST}",), supported_sets=2
    ),
    "unreal": Preset((0, 2, 1), (1, 1, 1), 100.0, False, (".exr", ".png"), (f"mesh through Interchange; {NEAREST}",)),
}


def preset(name: str, ending: str) -> Preset:
    """Return a preset. Raises RangeError for an unknown one, or an extension lossy in the engine."""
    found = PRESETS.get(name)
    if found is None:
        raise RangeError(f"`preset` is '{name}' (expected {', '.join(PRESETS)})")
    if ending not in found.endings:
        raise RangeError(f"preset {name}: it cuts 16-bit PNG to 8 bits", help=f"write {found.endings[0]}")
    return found


def to_engine(points: AnyArray, preset: Preset, *, lengths: bool = True) -> AnyArray:
    """Return points (..., 3) in m in the engine's axes and units; unscaled directions without `lengths`."""
    scale = preset.per_meter if lengths else 1.0
    return points[..., list(preset.axes)] * np.array(preset.signs, np.float64) * scale


def from_engine(points: AnyArray, preset: Preset, *, lengths: bool = True) -> AnyArray:
    """Return the inverse of `to_engine`."""
    scale = preset.per_meter if lengths else 1.0
    return (points / (np.array(preset.signs, np.float64) * scale))[..., list(np.argsort(preset.axes))]
