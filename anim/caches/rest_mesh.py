"""Rest mesh of a PC2 or MDD: the companion mesh to which the cache is applied, in its vertex order.

`walk.pc2` has `walk.pc2-rest.ply`, which no other cache shares; its comment stores a fingerprint of the cache's first
frame, which detects a rest mesh of an earlier cache of this name. Meshes of other programs are found by the cache's
name.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import PurePath

import numpy as np

from anim.arrays import Floats, Ints
from anim.caches import frame_blocks
from anim.caches.formats import mesh_frame
from anim.caches.formats.mesh_frame import MeshFrame
from anim.caches.storage import Inputs, Outputs, companion_name, open_bytes, suffix
from anim.errors import FormatError, RangeError
from anim.model import VertexCache

REST_EXTENSIONS = (".ply", ".obj", "")
OWN_SUFFIXES = ("-rest.ply", "-rest.obj")  # appended to the cache's whole name
OTHER_SUFFIXES = (
    "-rest.ply",
    "-rest.obj",
    ".ply",
    ".obj",
)  # appended to its name without extension, in this order


@dataclass(frozen=True, slots=True)
class RestMesh:
    """Companion mesh: faces (T, 3), none without a file; positions (V, 3); fps and up axis if stored."""

    faces: Ints
    positions: Floats | None = None
    fps: float | None = None
    up: str = "y"


def write(cache: VertexCache, outputs: Outputs, ending: str, mark: str, *, fps: float | None = None) -> None:
    """Write `NAME.pc2-rest.ply` (or .obj); "" writes none. Raises RangeError for another extension.

    mark: fingerprint of the cache's first frame, returned by `frame_blocks.write`.
    """
    if ending not in REST_EXTENSIONS:
        raise RangeError(f"`rest` is '{ending}' (expected .ply, .obj or nothing)")
    if not ending:
        return
    remark = {"up": cache.up, "of": mark} | ({} if fps is None else {"fps": f"{fps:.9g}"})
    mesh = MeshFrame(positions(cache).astype(np.float32), cache.faces, None, remark)
    with outputs.create(companion_name(outputs.main, f"-rest{ending}")) as file:
        file.write(mesh_frame.write(mesh, ending))


def read(inputs: Inputs, header: int, frames: int, vertices: int, note: Callable[[str], None]) -> RestMesh:
    """Return the first companion mesh of the main file that belongs to it.

    header: bytes before the cache's first frame. note: called with a line about ignored meshes, which have another
    vertex count or another cache's fingerprint, and about one identified only by its name.
    """
    there = set(inputs.names())
    mark = ""
    stem = PurePath(inputs.main).stem
    for name in (
        *(companion_name(inputs.main, place) for place in OWN_SUFFIXES),
        *(stem + place for place in OTHER_SUFFIXES),
    ):
        if name not in there or name == inputs.main:
            continue
        mesh = _opened(inputs, name)
        mark = mark or frame_blocks.fingerprint(inputs, header, frames, vertices)
        if len(mesh.positions) != vertices:
            note(f"'{name}' has {len(mesh.positions)} vertices, the cache {vertices}: left out")
        elif mesh.remark.get("of", mark) != mark:
            note(f"'{name}' is the rest mesh of another cache: left out")
        else:
            if "of" not in mesh.remark:
                note(f"faces and axes are those of '{name}', by its name and number of vertices")
            return _rest(mesh)
    return RestMesh(np.empty((0, 3), np.int64))


def positions(cache: VertexCache) -> Floats:
    """Return the rest mesh (V, 3), the first frame if the cache has none."""
    return cache.rest if cache.rest is not None else next(cache.chunks()).positions[0].astype(np.float64)


def _opened(inputs: Inputs, name: str) -> MeshFrame:
    try:
        with open_bytes(inputs, name) as data:
            return mesh_frame.read(data, suffix(name))
    except FormatError as error:
        raise error.at(f"'{name}'", " ") from None


def _rest(mesh: MeshFrame) -> RestMesh:
    fps = mesh.remark.get("fps", "")
    rate = float(fps) if fps.replace(".", "", 1).isdigit() and float(fps) > 0 else None
    return RestMesh(mesh.faces, mesh.positions.astype(np.float64), rate, mesh.remark.get("up", "y"))
