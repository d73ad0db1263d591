"""The rest mesh beside a PC2 or MDD: what the cache is put onto, every vertex in exactly the cache's order.

`walk.pc2` has `walk.pc2-rest.ply`, which no other cache shares; its comment holds a mark of the cache's first frame, so
that one which was left behind by an earlier cache of this name is told. Meshes of others are found by the cache's name.
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
from anim.caches.storage import Inputs, Outputs, companion_name, read_all, suffix
from anim.errors import FormatError, RangeError
from anim.model import VertexCache

REST_EXTENSIONS = (".ply", ".obj", "")
OURS = ("-rest.ply", "-rest.obj")  # behind the cache's whole name
OTHERS = ("-rest.ply", "-rest.obj", ".ply", ".obj")  # behind its name without the ending, asked in this order


@dataclass(frozen=True, slots=True)
class RestMesh:
    """What lies beside a cache: faces (T, 3), none if nothing does; positions (V, 3); fps and up as it says."""

    faces: Ints
    positions: Floats | None = None
    fps: float | None = None
    up: str = "y"


def write(cache: VertexCache, outputs: Outputs, ending: str, mark: str, *, fps: float | None = None) -> None:
    """Write `NAME.pc2-rest.ply` (or .obj) beside the cache; "" writes none. Raises RangeError for another ending.

    mark: of the cache's first frame, as `raw.write` gives it.
    """
    if ending not in REST_EXTENSIONS:
        raise RangeError(f"rest is '{ending}' (expected .ply, .obj or nothing)")
    if not ending:
        return
    remark = {"up": cache.up, "of": mark} | ({} if fps is None else {"fps": f"{fps:.9g}"})
    mesh = MeshFrame(positions(cache).astype(np.float32), cache.faces, None, remark)
    with outputs.create(companion_name(outputs.main, f"-rest{ending}")) as file:
        file.write(mesh_frame.write(mesh, ending))


def read(inputs: Inputs, header: int, frames: int, vertices: int, note: Callable[[str], None]) -> RestMesh:
    """Return the first rest mesh beside the main file that belongs to it.

    header: bytes before the cache's first frame. note: is told of meshes that are left out since they
    have another number of vertices or are marked as another cache's, and of one that only its name speaks for.
    """
    there = set(inputs.names())
    mark = ""
    stem = PurePath(inputs.main).stem
    for name in (*(companion_name(inputs.main, place) for place in OURS), *(stem + place for place in OTHERS)):
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
    """Return the mesh at rest (V, 3), the first frame where the cache has none."""
    return cache.rest if cache.rest is not None else next(cache.chunks()).positions[0].astype(np.float64)


def _opened(inputs: Inputs, name: str) -> MeshFrame:
    try:
        with read_all(inputs, name) as data:
            return mesh_frame.read(data, suffix(name))
    except FormatError as error:
        raise error.at(f"'{name}'", " ") from None


def _rest(mesh: MeshFrame) -> RestMesh:
    fps = mesh.remark.get("fps", "")
    rate = float(fps) if fps.replace(".", "", 1).isdigit() and float(fps) > 0 else None
    return RestMesh(mesh.faces, mesh.positions.astype(np.float64), rate, mesh.remark.get("up", "y"))
