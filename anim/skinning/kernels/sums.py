"""Weighted sums of rows: matrices, quaternions or dual quaternions (C, L) of a vertex's joints.

A sum of up to four is written once, not added to: half the time, since writing is what costs (measured).
"""

from __future__ import annotations

from anim.skinning.kernels.lanes import LANES, Held, Singles


def blend(m: Singles, matrices: Singles, held: Held, v: int, shares: Singles) -> None:
    """Set m (C, L) to the sum of a vertex's matrices (J, C, L), by weight."""
    begin, end = held.start[v], held.start[v + 1]
    for e in range(begin, end):
        w = held.weight[e]
        row = shares[e - begin]
        for f in range(LANES):
            row[f] = w
    _add_up(m, matrices, held, begin, end, shares)


def blend_turns(b: Singles, turns: Singles, held: Held, v: int, shares: Singles) -> None:
    """Set b (C, L) to the sum of a vertex's quaternions, or dual ones, on the side of the first: at least one there is.

    The first is the strongest, and per frame the others are turned into its hemisphere. So the sum is never shorter
    than the first one's weight, and can always be normalized, opposite rotations included.
    """
    begin, end = held.start[v], held.start[v + 1]
    pivot = turns[held.joint[begin]]
    for e in range(begin, end):
        w = held.weight[e]
        q = turns[held.joint[e]]
        row = shares[e - begin]
        for f in range(LANES):
            side = pivot[0, f] * q[0, f] + pivot[1, f] * q[1, f] + pivot[2, f] * q[2, f] + pivot[3, f] * q[3, f]
            row[f] = -w if side < 0 else w
    _add_up(b, turns, held, begin, end, shares)


def _add_up(total: Singles, terms: Singles, held: Held, begin: int, end: int, s: Singles) -> None:
    count = end - begin
    if count == 0:
        for i in range(total.shape[0]):
            for f in range(LANES):
                total[i, f] = 0
        return
    a = terms[held.joint[begin]]
    if count == 1:
        for i in range(total.shape[0]):
            for f in range(LANES):
                total[i, f] = s[0, f] * a[i, f]
        return
    b = terms[held.joint[begin + 1]]
    if count == 2:
        for i in range(total.shape[0]):
            for f in range(LANES):
                total[i, f] = s[0, f] * a[i, f] + s[1, f] * b[i, f]
        return
    c = terms[held.joint[begin + 2]]
    if count == 3:
        for i in range(total.shape[0]):
            for f in range(LANES):
                total[i, f] = s[0, f] * a[i, f] + s[1, f] * b[i, f] + s[2, f] * c[i, f]
        return
    d = terms[held.joint[begin + 3]]
    for i in range(total.shape[0]):
        for f in range(LANES):
            total[i, f] = s[0, f] * a[i, f] + s[1, f] * b[i, f] + s[2, f] * c[i, f] + s[3, f] * d[i, f]
    for e in range(begin + 4, end):
        a = terms[held.joint[e]]
        for i in range(total.shape[0]):
            for f in range(LANES):
                total[i, f] += s[e - begin, f] * a[i, f]
