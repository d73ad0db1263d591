"""Weighted sums of rows: matrices, quaternions or dual quaternions (C, L) of a vertex's joints.

Influences come in groups of four (`layout.GROUP`), so that a sum is written once for most vertices instead of
term by term: half the time, because writes dominate (measured).
"""

from __future__ import annotations

from anim.skinning.kernels.jit import inline
from anim.skinning.kernels.layout import GROUP, LANES, FloatArray, Influences


@inline
def blend(total: FloatArray, terms: FloatArray, influences: Influences, v: int, rows: int) -> None:
    """Set the first C rows of `total` to the weighted sum of a vertex's matrices (J, C, L).

    0 without influences.
    """
    begin, end = influences.start[v], influences.start[v + 1]
    if begin == end:
        total[:] = 0
    for e in range(begin, end, GROUP):
        a, b, c, d = (
            terms[influences.joint[e]],
            terms[influences.joint[e + 1]],
            terms[influences.joint[e + 2]],
            terms[influences.joint[e + 3]],
        )
        s, t, u, w = influences.weight[e], influences.weight[e + 1], influences.weight[e + 2], influences.weight[e + 3]
        for i in range(rows):
            if e == begin:
                for f in range(LANES):
                    total[i, f] = s * a[i, f] + t * b[i, f] + u * c[i, f] + w * d[i, f]
            else:
                for f in range(LANES):
                    total[i, f] = total[i, f] + s * a[i, f] + t * b[i, f] + u * c[i, f] + w * d[i, f]


@inline
def blend_quaternions(
    total: FloatArray, terms: FloatArray, influences: Influences, v: int, rows: int, signed: FloatArray
) -> None:
    """Set the first C rows of `total` to the sum of a vertex's quaternions in the first's hemisphere.

    Dual quaternions have 8 rows. A vertex has at least one influence. The first is the strongest, and per frame the
    others are negated if they are in the other hemisphere. So the sum is never shorter than the first one's weight, and
    can always be normalized, opposite rotations included. signed: (I, L), scratch buffer for the signed weights.
    """
    begin, end = influences.start[v], influences.start[v + 1]
    pivot = terms[influences.joint[begin]]
    for e in range(begin, end):
        weight, q, row = influences.weight[e], terms[influences.joint[e]], signed[e - begin]
        for f in range(LANES):
            side = pivot[0, f] * q[0, f] + pivot[1, f] * q[1, f] + pivot[2, f] * q[2, f] + pivot[3, f] * q[3, f]
            row[f] = -weight if side < 0 else weight
    for e in range(begin, end, GROUP):
        a, b, c, d = (
            terms[influences.joint[e]],
            terms[influences.joint[e + 1]],
            terms[influences.joint[e + 2]],
            terms[influences.joint[e + 3]],
        )
        s, t, u, w = signed[e - begin], signed[e - begin + 1], signed[e - begin + 2], signed[e - begin + 3]
        for i in range(rows):
            if e == begin:
                for f in range(LANES):
                    total[i, f] = s[f] * a[i, f] + t[f] * b[i, f] + u[f] * c[i, f] + w[f] * d[i, f]
            else:
                for f in range(LANES):
                    total[i, f] = total[i, f] + s[f] * a[i, f] + t[f] * b[i, f] + u[f] * c[i, f] + w[f] * d[i, f]
