"""JSON metadata of a vertex animation texture.

schema 1 · kind "vertex animation texture" · preset · engine {axes "x z y", signs, units_per_meter} · vertices · frames
· fps (if even) · times_s · width · height · rows_per_frame · origin "top left" · position {file, format, encoding,
offset, scale} · normal {the same} or null · mesh · uv_set: n of its TEXCOORD_n · uv_v "top" or
"bottom": origin of v · up. Positions are in the engine's axes and units.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from anim.caches.vat.presets import PRESETS, Preset
from anim.errors import FormatError

SCHEMA = 1
KIND = "vertex animation texture"
NOT_METADATA = "not vertex-animation-texture metadata"
FORMATS = ("float", "half", "unorm16")


@dataclass(frozen=True, slots=True)
class VatMetadata:
    """Metadata. format: of FORMATS; encoding: "absolute" or "offset" (from the rest mesh)."""

    preset: str
    position: str
    normal: str | None
    mesh: str
    format: str
    width: int
    rows: int
    encoding: str
    offset: tuple[float, ...]
    scale: tuple[float, ...]
    vertices: int
    times: tuple[float, ...]
    up: str
    uv_set: int = 1

    def with_normals(self, name: str) -> VatMetadata:
        """Return a copy with normals in a file of this name."""
        return replace(self, normal=name)


def text(about: VatMetadata, engine: Preset) -> bytes:
    """Return the JSON, UTF-8, one value a line."""
    times = np.array(about.times)
    steps = np.diff(times)
    even = len(steps) > 0 and float(np.ptp(steps)) < 1e-3 * float(steps.mean())
    unit = {"offset": [-1.0] * 3, "scale": [2.0] * 3} if about.format == "unorm16" else _plain()
    content: dict[str, Any] = {
        "schema": SCHEMA,
        "kind": KIND,
        "preset": about.preset,
        "engine": {
            "axes": " ".join("xyz"[axis] for axis in engine.axes),
            "signs": list(engine.signs),
            "units_per_meter": engine.per_meter,
            "advice": list(engine.advice),
        },
        "vertices": about.vertices,
        "frames": len(times),
        "fps": float(f"{1 / steps.mean():.6g}") if even else None,
        "times_s": list(about.times),
        "width": about.width,
        "height": about.rows * len(times),
        "rows_per_frame": about.rows,
        "origin": "top left",
        "position": {
            "file": about.position,
            "format": about.format,
            "encoding": about.encoding,
            "offset": list(about.offset),
            "scale": list(about.scale),
        },
        "normal": None if about.normal is None else {"file": about.normal, "format": about.format, **unit},
        "mesh": about.mesh,
        "uv_set": about.uv_set,
        "uv_v": "bottom" if engine.is_flipped else "top",
        "up": about.up,
    }
    return (json.dumps(content, indent=1, allow_nan=False) + "\n").encode()


def parse(data: bytes) -> VatMetadata:
    """Parse a JSON. Raises FormatError for foreign or incomplete metadata."""
    try:
        content = json.loads(data)
        if not isinstance(content, dict) or content.get("kind") != KIND or content["preset"] not in PRESETS:
            raise FormatError(NOT_METADATA)
        position, normal = content["position"], content["normal"]
        found = VatMetadata(
            content["preset"],
            str(position["file"]),
            None if normal is None else str(normal["file"]),
            str(content["mesh"]),
            str(position["format"]),
            int(content["width"]),
            int(content["rows_per_frame"]),
            str(position["encoding"]),
            tuple(float(value) for value in position["offset"]),
            tuple(float(value) for value in position["scale"]),
            int(content["vertices"]),
            tuple(float(value) for value in content["times_s"]),
            str(content["up"]),
            int(content.get("uv_set", 1)),
        )
        frames, height = len(found.times), found.rows * len(found.times)
        counts_fit = (content.get("frames", frames), content.get("height", height)) == (frames, height)
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
        raise FormatError(NOT_METADATA) from None
    shapes_fit = len(found.offset) == len(found.scale) == 3 and found.format in FORMATS and found.times
    if not all(map(math.isfinite, (*found.offset, *found.scale, *found.times))):
        raise FormatError("JSON holds NaN or infinity")
    if not (shapes_fit and counts_fit) or found.rows < 1 or not 0 < found.vertices <= found.width * found.rows:
        raise FormatError("JSON contradicts itself")
    return found


def _plain() -> dict[str, list[float]]:
    return {"offset": [0.0] * 3, "scale": [1.0] * 3}
