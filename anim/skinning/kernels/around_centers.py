"""Skinning about centers of rotation."""

from __future__ import annotations

import numpy as np

from anim.skinning.kernels.directions import clear_vertex, store_tile, turn_directions
from anim.skinning.kernels.lanes import LANES, TILE, Held, Room, Shape, Singles, Target
from anim.skinning.kernels.rows import load, transform, turn
from anim.skinning.kernels.sums import blend, blend_turns


def around_centers(
    shape: Shape,
    centers: Singles,
    held: Held,
    turns: Singles,
    rigids: Singles,
    stretches: Singles,
    first: int,
    last: int,
    room: Room,
    target: Target,
) -> None:
    """Write points turned about centers (V, 3, 1), which move by linear blending; NaN: the point is its own center.

    turns (J, 4, L) quaternions, rigids (J, 12, L) the same motions as matrices; stretches as in around_duals.
    """
    stretched = len(stretches) > 0
    turned = room.turns[:4]
    center = room.center
    for low in range(first, last, TILE):
        count = min(TILE, last - low)
        for v in range(count):
            if held.start[low + v] == held.start[low + v + 1]:
                clear_vertex(room, v)
                continue
            blend_turns(turned, turns, held, low + v, room.shares)
            blend(room.matrix, rigids, held, low + v, room.shares)
            point = room.points[v]
            load(point, shape.points[low + v])
            load(center, shape.points[low + v] if np.isnan(centers[low + v, 0, 0]) else centers[low + v])
            if stretched:
                blend(room.stretch, stretches, held, low + v, room.shares)
                transform(point, room.stretch)
                transform(center, room.stretch)
            _about(point, center, turned, room.matrix)
            turn_directions(room, v, shape, low + v, stretched)
        store_tile(room, count, low, target)


def _about(p: Singles, c: Singles, b: Singles, m: Singles) -> None:
    """Turn points by b about c, which moves by m."""
    for i in range(3):
        for f in range(LANES):
            p[i, f] -= c[i, f]
    turn(p, b)
    transform(c, m)
    for i in range(3):
        for f in range(LANES):
            p[i, f] += c[i, f]
