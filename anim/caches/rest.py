"""The rest mesh beside a PC2 or MDD: what the cache is put onto, every vertex in exactly the cache's order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, Ints
from anim.caches import still
from anim.caches.files import Inputs, Outputs, beside, whole
from anim.errors import FormatError, RangeError
from anim.model import VertexCache

REST_ENDINGS = (".ply", ".obj", "")
PLACES = ("-rest.ply", "-rest.obj", ".ply", ".obj")  # behind the cache's own name, asked in this order


@dataclass(frozen=True, slots=True)
class Rest:
    """What lies beside a cache: faces (T, 3), none if nothing does; positions (V, 3); fps and up as it says."""

    faces: Ints
    positions: Floats | None = None
    fps: float | None = None
    up: str = "y"


def write(cache: VertexCache, outputs: Outputs, ending: str, *, fps: float | None = None) -> None:
    """Write `NAME-rest.ply` (or .obj) beside the cache; "" writes none. Raises RangeError for another ending."""
    if ending not in REST_ENDINGS:
        raise RangeError(f"rest is '{ending}' (expected .ply, .obj or nothing)")
    if not ending:
        return
    remark = {"up": cache.up} | ({} if fps is None else {"fps": f"{fps:.9g}"})
    name = beside(outputs.main, f"-rest{ending}")
    mesh = still.Still(positions(cache).astype(np.float32), cache.faces, None, remark)
    with outputs.create(name) as file:
        file.write(still.write(mesh, ending))


def read(inputs: Inputs, vertices: int) -> Rest:
    """Return the rest mesh beside the main file, if one has as many vertices."""
    there = set(inputs.names())
    for place in PLACES:
        name = beside(inputs.main, place)
        if name not in there:
            continue
        try:
            with whole(inputs, name) as data:
                mesh = still.read(data, name[-4:])
        except FormatError as error:
            raise error.at(f"'{name}'", " ") from None
        if len(mesh.positions) == vertices:
            fps = mesh.remark.get("fps", "")
            rate = float(fps) if fps.replace(".", "", 1).isdigit() and float(fps) > 0 else None
            return Rest(mesh.faces, mesh.positions.astype(np.float64), rate, mesh.remark.get("up", "y"))
    return Rest(np.empty((0, 3), np.int64))


def positions(cache: VertexCache) -> Floats:
    """Return the mesh at rest (V, 3), the first frame where the cache has none."""
    return cache.rest if cache.rest is not None else next(cache.chunks()).positions[0].astype(np.float64)
