"""Linear blending of points that never change, without directions: the shortest way."""

from __future__ import annotations

from anim.skinning.kernels.lanes import LANES, TILE, Held, Singles, Target


def points_only(
    coefficients: Singles, held: Held, matrices: Singles, first: int, last: int, tile: Singles, target: Target
) -> None:
    """Write Σ w M p: coefficients (E, 4) are w·(x, y, z, 1), matrices (J, 4, 3L) columns, frame by frame x, y, z.

    tile: (TILE, 3L), room to work in.
    """
    for low in range(first, last, TILE):
        count = min(TILE, last - low)
        for v in range(count):
            moved = tile[v]
            begin, end = held.start[low + v], held.start[low + v + 1]
            if begin == end:
                for i in range(3 * LANES):
                    moved[i] = 0
                continue
            a, c = matrices[held.joint[begin]], coefficients[begin]
            x, y, z, w = c[0], c[1], c[2], c[3]
            for i in range(3 * LANES):
                moved[i] = x * a[0, i] + y * a[1, i] + z * a[2, i] + w * a[3, i]
            for e in range(begin + 1, end):
                a, c = matrices[held.joint[e]], coefficients[e]
                x, y, z, w = c[0], c[1], c[2], c[3]
                for i in range(3 * LANES):
                    moved[i] += x * a[0, i] + y * a[1, i] + z * a[2, i] + w * a[3, i]
        for f in range(len(target.positions)):
            frame = target.positions[f]
            for v in range(count):
                frame[target.at + low + v, 0] = tile[v, 3 * f]
                frame[target.at + low + v, 1] = tile[v, 3 * f + 1]
                frame[target.at + low + v, 2] = tile[v, 3 * f + 2]
