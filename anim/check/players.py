"""Players and the parts of glTF that they do not play as specified, from their sources.

Read between 2025-11 and 2026-08: Unity glTFast 6.14, Godot 4, Unreal Interchange (API pages of 5.4), three.js r187,
Babylon.js, bevy, Filament and Scene Viewer, raylib; Quick Look by usd_from_gltf (2020).
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple


class Player(NamedTuple):
    """Support of a player. cubic, step, pointer: text on the problem, "" if it plays them.

    influences, joints, morph_targets, skins, clips, roots: largest numbers, None for no limit known. extensions: not
    supported ones.
    """

    cubic: str = ""
    step: str = ""
    pointer: str = ""
    influences: int | None = None
    joints: int | None = None
    morph_targets: int | None = None
    skins: int | None = None
    clips: int | None = None
    roots: int | None = None
    extensions: frozenset[str] = frozenset()


QUANTIZATION = "KHR_mesh_quantization"
MESHOPT = frozenset({"EXT_meshopt_compression", "KHR_meshopt_compression"})
NO_POINTER = "KHR_animation_pointer is not supported"

PLAYERS: Mapping[str, Player] = MappingProxyType(
    {
        "unity": Player(
            cubic="CUBICSPLINE plays with wrong tangents",
            pointer=NO_POINTER,
            influences=4,
            extensions=frozenset({"KHR_meshopt_compression"}),
        ),
        "godot": Player(cubic="CUBICSPLINE is baked to 30 LINEAR keys per second", influences=4),
        "unreal": Player(pointer=NO_POINTER, roots=1, extensions=MESHOPT | {QUANTIZATION}),
        "three": Player(pointer="KHR_animation_pointer needs a plugin", influences=4, morph_targets=256),
        "babylon": Player(influences=8, extensions=frozenset({"KHR_meshopt_compression"})),
        "bevy": Player(
            pointer=NO_POINTER, influences=4, joints=256, morph_targets=256, extensions=MESHOPT | {QUANTIZATION}
        ),
        "scene-viewer": Player(pointer=NO_POINTER, influences=4, joints=254, morph_targets=256, clips=1),
        "quick-look": Player(
            cubic="CUBICSPLINE is not supported",
            step="STEP is not supported",
            pointer=NO_POINTER,
            morph_targets=0,
            skins=1,
            clips=1,
        ),
        "raylib": Player(
            cubic="CUBICSPLINE is sampled 60 times per second",
            pointer=NO_POINTER,
            influences=4,
            morph_targets=0,
            skins=1,
        ),
    }
)
