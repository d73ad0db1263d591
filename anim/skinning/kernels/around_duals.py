"""Skinning by blended dual quaternions."""

from __future__ import annotations

from anim.skinning.kernels.directions import clear_vertex, store_tile, turn_directions
from anim.skinning.kernels.lanes import LANES, TILE, Held, Room, Shape, Singles, Target
from anim.skinning.kernels.rows import TWO, load, transform
from anim.skinning.kernels.sums import blend, blend_turns


def around_duals(
    shape: Shape, held: Held, duals: Singles, stretches: Singles, first: int, last: int, room: Room, target: Target
) -> None:
    """Write points moved by blended dual quaternions (J, 8, L), after stretches (J, 12, L) or (0, 12, L)."""
    stretched = len(stretches) > 0
    for low in range(first, last, TILE):
        count = min(TILE, last - low)
        for v in range(count):
            if held.start[low + v] == held.start[low + v + 1]:
                clear_vertex(room, v)
                continue
            blend_turns(room.turns, duals, held, low + v, room.shares)
            point = room.points[v]
            load(point, shape.points[low + v])
            if stretched:
                blend(room.stretch, stretches, held, low + v, room.shares)
                transform(point, room.stretch)
            _move(point, room.turns)
            turn_directions(room, v, shape, low + v, stretched)
        store_tile(room, count, low, target)


def _move(p: Singles, b: Singles) -> None:
    """Move points by dual quaternions (8, L) of any length but 0."""
    for f in range(LANES):
        x, y, z, w = b[0, f], b[1, f], b[2, f], b[3, f]
        dx, dy, dz, dw = b[4, f], b[5, f], b[6, f], b[7, f]
        two = TWO / (x * x + y * y + z * z + w * w)
        px, py, pz = p[0, f], p[1, f], p[2, f]
        cx = y * pz - z * py + w * px + dx
        cy = z * px - x * pz + w * py + dy
        cz = x * py - y * px + w * pz + dz
        p[0, f] = px + two * (y * cz - z * cy + w * dx - dw * x)
        p[1, f] = py + two * (z * cx - x * cz + w * dy - dw * y)
        p[2, f] = pz + two * (x * cy - y * cx + w * dz - dw * z)
