"""What readers and writers of caches may need to be told; each takes what concerns it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """fps: frames per second where a format keeps none (PC2, frame sequences, USD without a rate).

    note: called with what the user should know about what was read, a line each.
    """

    fps: float | None = None
    note: Callable[[str], None] = lambda _: None


@dataclass(frozen=True, slots=True)
class WriteOptions:
    """Settings of all formats.

    max_error: m, how far a vertex may lie from where it was, for morph targets and textures' own report.
    quantize: whether glTF numbers become integers by KHR_mesh_quantization.
    layout: how a .glb keeps frames, one of LAYOUTS of anim.caches.formats.gltf.
    preset: whose axes and rows a texture has, one of PRESETS of anim.caches.vat.presets.
    depth: of a texture's numbers: "half" or "float" in EXR.
    rest_mesh: ending of the rest mesh beside a PC2 or MDD: ".ply", ".obj", or "" for none.
    """

    max_error: float | None = None
    quantize: bool = False
    layout: str = "morph"
    preset: str = "plain"
    depth: str = "float"
    rest_mesh: str = ".ply"


@dataclass(frozen=True, slots=True)
class WriteResult:
    """What came of writing. max_error: m, farthest that a vertex is from where it was; None where nothing is lost.

    notes: what the user should know, a line each.
    """

    max_error: float | None = None
    notes: tuple[str, ...] = ()
