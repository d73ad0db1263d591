"""Linear blending of matrices, for points that change, or with directions."""

from __future__ import annotations

from anim.skinning.kernels.directions import move_directions, store_tile
from anim.skinning.kernels.lanes import TILE, Held, Room, Shape, Singles, Target
from anim.skinning.kernels.rows import load, transform
from anim.skinning.kernels.sums import blend


def linear(shape: Shape, held: Held, matrices: Singles, first: int, last: int, room: Room, target: Target) -> None:
    """Write (Σ w M) p, normals by the inverse transpose of Σ w M and tangents by it; matrices (J, 12, L)."""
    for low in range(first, last, TILE):
        count = min(TILE, last - low)
        for v in range(count):
            blend(room.matrix, matrices, held, low + v, room.shares)
            point = room.points[v]
            load(point, shape.points[low + v])
            transform(point, room.matrix)
            move_directions(room, v, shape, low + v, room.matrix)
        store_tile(room, count, low, target)
