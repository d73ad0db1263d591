"""Where nodes stand: local transforms to world matrices, parents first, in float64."""

from __future__ import annotations

from anim.arrays import Floats, Ints


def worlds(
    translation: Floats,
    rotation: Floats,
    scale: Floats,
    order: Ints,
    parents: Ints,
    fixed: Ints,
    fixed_local: Floats,
    world: Floats,
) -> None:
    """Write world_from_node (N, F, 3, 4) of translation (F, N, 3) m, unit rotation (F, N, 4) xyzw and scale (F, N, 3).

    order: (N,) all nodes, parents before children. parents: (N,), −1 for roots. fixed: (N,) which of fixed_local
    (X, 3, 4) is a node's local matrix instead, −1 for none.
    """
    for n in order:
        above, given = parents[n], fixed[n]
        for f in range(world.shape[1]):
            m = world[n, f]
            if given < 0:
                set_local(m, translation[f, n], rotation[f, n], scale[f, n])
            else:
                for i in range(3):
                    for k in range(4):
                        m[i, k] = fixed_local[given, i, k]
            if above >= 0:
                put_under(m, world[above, f])


def set_local(m: Floats, t: Floats, q: Floats, s: Floats) -> None:
    """Set m (3, 4) to T·R·S."""
    x, y, z, w = q[0], q[1], q[2], q[3]
    x2, y2, z2 = x + x, y + y, z + z
    m[0, 0] = (1 - (y * y2 + z * z2)) * s[0]
    m[0, 1] = (x * y2 - w * z2) * s[1]
    m[0, 2] = (x * z2 + w * y2) * s[2]
    m[1, 0] = (x * y2 + w * z2) * s[0]
    m[1, 1] = (1 - (x * x2 + z * z2)) * s[1]
    m[1, 2] = (y * z2 - w * x2) * s[2]
    m[2, 0] = (x * z2 - w * y2) * s[0]
    m[2, 1] = (y * z2 + w * x2) * s[1]
    m[2, 2] = (1 - (x * x2 + y * y2)) * s[2]
    m[0, 3], m[1, 3], m[2, 3] = t[0], t[1], t[2]


def put_under(m: Floats, parent: Floats) -> None:
    """Set m (3, 4) to parent · m."""
    for k in range(4):
        x, y, z = m[0, k], m[1, k], m[2, k]
        for i in range(3):
            m[i, k] = parent[i, 0] * x + parent[i, 1] * y + parent[i, 2] * z
    for i in range(3):
        m[i, 3] += parent[i, 3]
