"""Inputs of UsdPreviewSurface from a glTF material: constants, and channels of textures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from anim.caches.source_document.checked_materials import EMISSIVE_STRENGTH
from anim.caches.source_document.lit_meshes import UNLIT
from anim.gltf.document import Json
from anim.gltf.reading.materials import DEFAULT_ALPHA_CUTOFF

WHITE = (1.0, 1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class TextureInput:
    """An input of UsdPreviewSurface from channels of a texture: value = texel · scale + bias."""

    input: str
    channels: str
    info: Json
    space: str
    scale: tuple[float, ...] = WHITE
    bias: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)


def input_types(sdf: Any) -> dict[str, Any]:
    """Return the types of inputs by name."""
    types = sdf.ValueTypeNames
    numbers = dict.fromkeys(("metallic", "roughness", "opacity", "opacityThreshold", "occlusion"), types.Float)
    colors = dict.fromkeys(("diffuseColor", "emissiveColor"), types.Color3f)
    return {**numbers, **colors, "normal": types.Normal3f}


def constant_inputs(about: Json) -> dict[str, Any]:
    """Return the inputs with one value; those with a texture too are replaced by its connection."""
    surface = about.get("pbrMetallicRoughness", {})
    color = tuple(surface.get("baseColorFactor", WHITE))
    found: dict[str, Any] = {"diffuseColor": color[:3], "emissiveColor": _emission(about)}
    if UNLIT in about.get("extensions", {}):
        found |= {"diffuseColor": (0.0, 0.0, 0.0), "emissiveColor": color[:3], "metallic": 0.0, "roughness": 1.0}
    else:
        found |= {"metallic": surface.get("metallicFactor", 1.0), "roughness": surface.get("roughnessFactor", 1.0)}
    mode, alpha, cutoff = _alpha(about)
    if mode == "BLEND":
        found["opacity"] = alpha
    if mode == "MASK":
        found |= {"opacity": float(alpha >= cutoff), "opacityThreshold": cutoff / alpha if alpha > 0 else cutoff}
    return found


def _alpha(about: Json) -> tuple[str, float, float]:
    """Alpha mode, factor and cutoff; OPAQUE for a cutoff of 0, which is blending in USD."""
    mode, cutoff = about.get("alphaMode", "OPAQUE"), about.get("alphaCutoff", DEFAULT_ALPHA_CUTOFF)
    alpha = about.get("pbrMetallicRoughness", {}).get("baseColorFactor", WHITE)[3]
    return ("OPAQUE" if mode == "MASK" and cutoff <= 0 else mode), alpha, cutoff


def _texture_alpha(mode: str, alpha: float) -> float:
    return 1.0 if mode == "MASK" and alpha > 0 else alpha


def _emission(about: Json) -> tuple[float, ...]:
    strength = about.get("extensions", {}).get(EMISSIVE_STRENGTH, {}).get("emissiveStrength", 1.0)
    return tuple(strength * each for each in about.get("emissiveFactor", (0.0, 0.0, 0.0)))


def texture_inputs(about: Json) -> Iterator[TextureInput]:
    """Yield the inputs of a material that have textures."""
    surface = about.get("pbrMetallicRoughness", {})
    is_unlit = UNLIT in about.get("extensions", {})
    color = tuple(surface.get("baseColorFactor", WHITE))[:3]
    if base := surface.get("baseColorTexture"):
        yield TextureInput("emissiveColor" if is_unlit else "diffuseColor", "rgb", base, "sRGB", (*color, 1.0))
        mode, alpha, _ = _alpha(about)
        # A factor of alpha divides the cutoff, since three.js and Blender ignore its scale in a texture.
        if mode != "OPAQUE":
            yield TextureInput("opacity", "a", base, "sRGB", (1.0, 1.0, 1.0, _texture_alpha(mode, alpha)))
    if is_unlit:
        return
    if packed := surface.get("metallicRoughnessTexture"):
        scale = (1.0, surface.get("roughnessFactor", 1.0), surface.get("metallicFactor", 1.0), 1.0)
        yield TextureInput("roughness", "g", packed, "raw", scale)
        yield TextureInput("metallic", "b", packed, "raw", scale)
    if normal := about.get("normalTexture"):
        yield TextureInput("normal", "rgb", normal, "raw", (2.0, 2.0, 2.0, 1.0), (-1.0, -1.0, -1.0, 0.0))
    if emissive := about.get("emissiveTexture"):
        yield TextureInput("emissiveColor", "rgb", emissive, "sRGB", (*_emission(about), 1.0))
    if occlusion := about.get("occlusionTexture"):
        strength = occlusion.get("strength", 1.0)
        yield TextureInput("occlusion", "r", occlusion, "raw", (strength,) * 4, (1.0 - strength,) * 4)
