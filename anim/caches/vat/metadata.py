"""JSON metadata of a vertex animation texture.

schema 1 · kind "vertex animation texture" · preset · engine {axes "x z y", signs, units_per_meter} · vertices · frames
· fps (if even) · times_s · width · height · rows_per_frame · origin "top left" · position {file, format, encoding,
offset, scale} · normal {the same} or null · mesh · uv_set: n of its TEXCOORD_n · uv_v "top" or
"bottom": origin of v · up. Positions are in the engine's axes and units.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from anim.caches.vat.members import Members
from anim.caches.vat.presets import PRESETS, Preset
from anim.errors import FormatError

SCHEMA = 1
KIND = "vertex animation texture"
NOT_METADATA = "not vertex-animation-texture metadata"
FORMATS = ("float", "half", "unorm16")
ENCODINGS = ("absolute", "offset")
UP_AXES = ("y", "z")
ORIGIN = "top left"


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
            "axes": _axes(engine),
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
        "origin": ORIGIN,
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
    """Parse a JSON. Raises FormatError, which names the member, for foreign, incomplete or contradictory metadata."""
    try:
        content = json.loads(data)
    except (ValueError, RecursionError):
        content = None
    if not isinstance(content, dict) or content.get("kind") != KIND:
        raise FormatError(NOT_METADATA)
    members = Members(content)
    _check_fixed(members)
    position = members.child("position")
    encoding = position.text("format", FORMATS)
    found = VatMetadata(
        members.text("preset", PRESETS),
        position.text("file"),
        _normal_file(members, encoding),
        members.text("mesh"),
        encoding,
        members.count("width", 1),
        members.count("rows_per_frame", 1),
        position.text("encoding", ENCODINGS),
        position.numbers("offset", 3),
        position.numbers("scale", 3),
        members.count("vertices", 1),
        members.numbers("times_s"),
        members.text("up", UP_AXES),
        members.count("uv_set", 0, default=1),
    )
    _check_engine(members, found.preset)
    _check_counts(members, found)
    return found


def _check_fixed(members: Members) -> None:
    """Raise FormatError for members of this schema that readers of the pixels rely on."""
    if members.count("schema", 1, default=SCHEMA) != SCHEMA:
        raise FormatError(f"schema is {members.count('schema', 1)} (expected {SCHEMA})")
    members.text("origin", [ORIGIN], default=ORIGIN)
    members.text("uv_v", ("top", "bottom"), default="top")
    if members.is_set("fps"):
        members.number("fps")


def _check_engine(members: Members, preset: str) -> None:
    """Raise FormatError for axes and units other than those of the preset, by which pixels are read."""
    if not members.is_set("engine"):
        return
    engine, expected = members.child("engine"), PRESETS[preset]
    engine.text("axes", [_axes(expected)])
    for key, found, wanted in (
        ("signs", engine.numbers("signs", 3), expected.signs),
        ("units_per_meter", engine.number("units_per_meter"), expected.per_meter),
    ):
        if found != wanted:
            raise FormatError(f"engine.{key} is {found} (expected {wanted}, as preset {preset} has)")


def _axes(engine: Preset) -> str:
    """Axes of glTF that are those of an engine: "x z y"."""
    return " ".join("xyz"[axis] for axis in engine.axes)


def _normal_file(members: Members, encoding: str) -> str | None:
    """File of the normals, which are encoded as positions are."""
    if not members.is_set("normal"):
        return None
    normal = members.child("normal")
    normal.text("format", [encoding], default=encoding)
    return normal.text("file")


def _check_counts(members: Members, found: VatMetadata) -> None:
    """Raise FormatError for numbers of frames, pixels and vertices that contradict each other."""
    frames = len(found.times)
    for key, expected in (("frames", frames), ("height", found.rows * frames)):
        if members.count(key, 1, default=expected) != expected:
            raise FormatError(f"{key} is {members.count(key, 1)} (expected {expected}, by times_s and rows_per_frame)")
    if found.vertices > found.width * found.rows:
        raise FormatError(
            f"vertices is {found.vertices} (expected {found.width * found.rows} or fewer, by width and rows_per_frame)"
        )


def _plain() -> dict[str, list[float]]:
    return {"offset": [0.0] * 3, "scale": [1.0] * 3}
