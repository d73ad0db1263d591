"""What all methods do with a vertex's normal and tangent, and with a whole tile when it is full."""

from __future__ import annotations

from anim.skinning.kernels.lanes import Room, Shape, Singles, Target
from anim.skinning.kernels.rows import clear, load, make_unit, store, transform_normal, transform_tangent, turn


def move_directions(room: Room, v: int, shape: Shape, at: int, m: Singles) -> None:
    """Set number v of the tile to vertex `at`'s normal and tangent, moved by matrices."""
    if len(shape.normals):
        normal = room.normals[v]
        load(normal, shape.normals[at])
        transform_normal(normal, m)
        make_unit(normal)
    if len(shape.tangents):
        tangent = room.tangents[v]
        load(tangent, shape.tangents[at])
        transform_tangent(tangent, m)
        make_unit(tangent)


def turn_directions(room: Room, v: int, shape: Shape, at: int, stretched: bool) -> None:
    """Set number v of the tile to vertex `at`'s normal and tangent, stretched if need be, and turned."""
    if len(shape.normals):
        normal = room.normals[v]
        load(normal, shape.normals[at])
        if stretched:
            transform_normal(normal, room.stretch)
        turn(normal, room.turns)
        make_unit(normal)
    if len(shape.tangents):
        tangent = room.tangents[v]
        load(tangent, shape.tangents[at])
        if stretched:
            transform_tangent(tangent, room.stretch)
        turn(tangent, room.turns)
        make_unit(tangent)


def clear_vertex(room: Room, v: int) -> None:
    """Set number v of the tile to the origin, without a direction."""
    clear(room.points[v])
    clear(room.normals[v])
    clear(room.tangents[v])


def store_tile(room: Room, count: int, first: int, target: Target) -> None:
    """Write the first `count` vertices of the tile, from column at + first on."""
    store(room.points, count, target.at + first, target.positions)
    if len(target.normals):
        store(room.normals, count, target.at + first, target.normals)
    if len(target.tangents):
        store(room.tangents, count, target.at + first, target.tangents)
