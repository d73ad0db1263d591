"""Options of cache readers and writers; each format uses those it supports."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from anim.caches.source_document.bake_source import BakeSource
from anim.errors import RangeError

MIN_INPUT_FPS, MAX_INPUT_FPS = 1e-6, 1e6  # frames per second
MAX_TARGETS = 256  # morph targets: layers of an array texture in WebGL2, and the limits of bevy and Filament


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """input_fps: frames per second for formats without a rate (PC2, frame sequences, USD without a rate).

    note: called with a line for each fact that the user should know about the input.
    Raises RangeError for a rate at which frames have no distinct times, or none at all.
    """

    input_fps: float | None = None
    note: Callable[[str], None] = lambda _: None

    def __post_init__(self) -> None:
        if self.input_fps is not None and not MIN_INPUT_FPS <= self.input_fps <= MAX_INPUT_FPS:
            limits = f"{MIN_INPUT_FPS:g} to {MAX_INPUT_FPS:g}"
            raise RangeError(f"`input_fps` is {self.input_fps:g} (expected {limits})")


@dataclass(frozen=True, slots=True)
class WriteOptions:
    """Options of all formats.

    max_error: m, maximum error of a vertex, for morph targets and the report of textures.
    quantize: store glTF values as integers by KHR_mesh_quantization.
    layout: storage of frames in a .glb, one of LAYOUTS of anim.caches.formats.gltf.
    preset: engine that defines a texture's axes and row order, one of PRESETS of anim.caches.vat.presets.
    depth: number type of a texture: "half" or "float" in EXR.
    rest_mesh: file extension of the rest mesh of a PC2 or MDD: ".ply", ".obj", or "" for none.
    max_targets: largest number of morph targets.
    source: document that the cache is a bake of; its materials and texture coordinates are kept. None for one material.
    """

    max_error: float | None = None
    quantize: bool = False
    layout: str = "morph"
    preset: str = "plain"
    depth: str = "float"
    rest_mesh: str = ".ply"
    max_targets: int = MAX_TARGETS
    source: BakeSource | None = None


@dataclass(frozen=True, slots=True)
class WriteResult:
    """Result of writing. max_error: m, maximum error of a vertex; None if lossless.

    notes: lines for the user.
    """

    max_error: float | None = None
    notes: tuple[str, ...] = ()
