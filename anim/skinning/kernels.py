"""The loops of all methods. Plain functions over arrays: `compiled` makes machine code of them.

Frames are the innermost axis, L = LANES of them, so that every step is a multiply-add along a row and nothing is
gathered twice. Row views (a = matrices[j]) and plain loop variables let the compiler see that; computed indices cost 5×
(measured). The helpers below the kernels work on rows of one vertex: points and normals (3, L), matrices (12, L) row by
row.

Influences come strongest first, so a vertex's first one is the pivot whose hemisphere the others are turned into, per
vertex and frame. The blended quaternion is then never shorter than the pivot's weight, so it can always be normalized,
opposite rotations included. A vertex without any influence goes to the origin, as its sum says.

Every kernel takes the vertices first … last and writes them into columns `at` + v of out (n, all V, 3). points and
normals are (V, 3, m), m = 1 where all frames share them, else L; normals of length 0 are not wanted. What is beyond
the frames of `out` is padding.
"""

from __future__ import annotations

import numpy as np

from anim.arrays import Ints
from anim.skinning.rig import Singles

LANES = 32  # frames that a kernel takes at a time; a constant, so that the compiler sees what lies where
TILE = 64  # vertices between two transpositions to frame-major order
TINY = np.float32(1e-30)
ONE, TWO = np.float32(1), np.float32(2)


def points_only(
    coefficients: Singles, joint: Ints, start: Ints, matrices: Singles, first: int, last: int, at: int, out: Singles
) -> None:
    """Write Σ w M p: coefficients (E, 4) are w·(x, y, z, 1), matrices (J, 4, 3L) columns, frame by frame x, y, z."""
    tile = np.empty((TILE, 3 * LANES), np.float32)
    for low in range(first, last, TILE):
        count = min(TILE, last - low)
        for v in range(count):
            moved = tile[v]
            for i in range(3 * LANES):
                moved[i] = 0
            for e in range(start[low + v], start[low + v + 1]):
                c = coefficients[e]
                x, y, z, w = c[0], c[1], c[2], c[3]
                a = matrices[joint[e]]
                for i in range(3 * LANES):
                    moved[i] += x * a[0, i] + y * a[1, i] + z * a[2, i] + w * a[3, i]
        for f in range(len(out)):
            frame = out[f]
            for v in range(count):
                frame[at + low + v, 0] = tile[v, 3 * f]
                frame[at + low + v, 1] = tile[v, 3 * f + 1]
                frame[at + low + v, 2] = tile[v, 3 * f + 2]


def linear(
    points: Singles,
    normals: Singles,
    weight: Singles,
    joint: Ints,
    start: Ints,
    matrices: Singles,
    first: int,
    last: int,
    at: int,
    out: Singles,
    out_normals: Singles,
) -> None:
    """Write (Σ w M) p, and normals by the inverse transpose of Σ w M; matrices (J, 12, L)."""
    m = np.empty((12, LANES), np.float32)
    tile = np.empty((TILE, 3, LANES), np.float32)
    normal_tile = np.empty((TILE, 3, LANES), np.float32)
    for low in range(first, last, TILE):
        count = min(TILE, last - low)
        for v in range(count):
            _blend(m, matrices, weight, joint, start[low + v], start[low + v + 1])
            _load(tile[v], points[low + v])
            _transform(tile[v], m)
            if len(normals):
                _load(normal_tile[v], normals[low + v])
                _transform_normal(normal_tile[v], m)
                _make_unit(normal_tile[v])
        _store(tile, count, at + low, out)
        if len(normals):
            _store(normal_tile, count, at + low, out_normals)


def around_duals(
    points: Singles,
    normals: Singles,
    weight: Singles,
    joint: Ints,
    start: Ints,
    duals: Singles,
    stretches: Singles,
    first: int,
    last: int,
    at: int,
    out: Singles,
    out_normals: Singles,
) -> None:
    """Write points moved by blended dual quaternions (J, 8, L), after stretches (J, 12, L) or (0, 12, L)."""
    b = np.empty((8, LANES), np.float32)
    s = np.empty((12, LANES), np.float32)
    signed = np.empty(LANES, np.float32)
    tile = np.empty((TILE, 3, LANES), np.float32)
    normal_tile = np.empty((TILE, 3, LANES), np.float32)
    for low in range(first, last, TILE):
        count = min(TILE, last - low)
        for v in range(count):
            begin, end = start[low + v], start[low + v + 1]
            p = tile[v]
            if begin == end:
                _clear(p)
                _clear(normal_tile[v])
                continue
            _blend_turns(b, signed, duals, weight, joint, begin, end)
            _load(p, points[low + v])
            if len(stretches):
                _blend(s, stretches, weight, joint, begin, end)
                _transform(p, s)
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
            if len(normals):
                _load(normal_tile[v], normals[low + v])
                if len(stretches):
                    _transform_normal(normal_tile[v], s)
                _turn(normal_tile[v], b)
                _make_unit(normal_tile[v])
        _store(tile, count, at + low, out)
        if len(normals):
            _store(normal_tile, count, at + low, out_normals)


def around_centers(
    points: Singles,
    normals: Singles,
    centers: Singles,
    weight: Singles,
    joint: Ints,
    start: Ints,
    turns: Singles,
    rigids: Singles,
    stretches: Singles,
    first: int,
    last: int,
    at: int,
    out: Singles,
    out_normals: Singles,
) -> None:
    """Write points turned about centers (V, 3, 1), which move by linear blending; NaN: the point is its own center.

    turns (J, 4, L) quaternions, rigids (J, 12, L) the same motions as matrices; stretches as in around_duals.
    """
    b = np.empty((4, LANES), np.float32)
    m = np.empty((12, LANES), np.float32)
    s = np.empty((12, LANES), np.float32)
    c = np.empty((3, LANES), np.float32)
    signed = np.empty(LANES, np.float32)
    tile = np.empty((TILE, 3, LANES), np.float32)
    normal_tile = np.empty((TILE, 3, LANES), np.float32)
    for low in range(first, last, TILE):
        count = min(TILE, last - low)
        for v in range(count):
            begin, end = start[low + v], start[low + v + 1]
            p = tile[v]
            if begin == end:
                _clear(p)
                _clear(normal_tile[v])
                continue
            _blend_turns(b, signed, turns, weight, joint, begin, end)
            _blend(m, rigids, weight, joint, begin, end)
            _load(p, points[low + v])
            _load(c, points[low + v] if np.isnan(centers[low + v, 0, 0]) else centers[low + v])
            if len(stretches):
                _blend(s, stretches, weight, joint, begin, end)
                _transform(p, s)
                _transform(c, s)
            for i in range(3):
                for f in range(LANES):
                    p[i, f] -= c[i, f]
            _turn(p, b)
            _transform(c, m)
            for i in range(3):
                for f in range(LANES):
                    p[i, f] += c[i, f]
            if len(normals):
                _load(normal_tile[v], normals[low + v])
                if len(stretches):
                    _transform_normal(normal_tile[v], s)
                _turn(normal_tile[v], b)
                _make_unit(normal_tile[v])
        _store(tile, count, at + low, out)
        if len(normals):
            _store(normal_tile, count, at + low, out_normals)


def _clear(row: Singles) -> None:
    for i in range(row.shape[0]):
        for f in range(LANES):
            row[i, f] = 0


def _load(row: Singles, source: Singles) -> None:
    """Copy (3, m) into (3, L), the one column into all where m = 1."""
    alone = source.shape[1] == 1
    for i in range(3):
        for f in range(LANES):
            row[i, f] = source[i, 0 if alone else f]


def _blend(m: Singles, matrices: Singles, weight: Singles, joint: Ints, begin: int, end: int) -> None:
    """Set m to the weighted sum of matrices."""
    _clear(m)
    for e in range(begin, end):
        w = weight[e]
        a = matrices[joint[e]]
        for i in range(12):
            for f in range(LANES):
                m[i, f] += w * a[i, f]


def _blend_turns(
    b: Singles, signed: Singles, turns: Singles, weight: Singles, joint: Ints, begin: int, end: int
) -> None:
    """Set b (C, L) to the weighted sum of quaternions, or dual ones, on the side of the first."""
    pivot = turns[joint[begin]]
    w = weight[begin]
    for i in range(len(b)):
        for f in range(LANES):
            b[i, f] = w * pivot[i, f]
    for e in range(begin + 1, end):
        w = weight[e]
        q = turns[joint[e]]
        for f in range(LANES):
            side = pivot[0, f] * q[0, f] + pivot[1, f] * q[1, f] + pivot[2, f] * q[2, f] + pivot[3, f] * q[3, f]
            signed[f] = -w if side < 0 else w
        for i in range(len(b)):
            for f in range(LANES):
                b[i, f] += signed[f] * q[i, f]


def _transform(p: Singles, m: Singles) -> None:
    for f in range(LANES):
        x, y, z = p[0, f], p[1, f], p[2, f]
        p[0, f] = m[0, f] * x + m[1, f] * y + m[2, f] * z + m[3, f]
        p[1, f] = m[4, f] * x + m[5, f] * y + m[6, f] * z + m[7, f]
        p[2, f] = m[8, f] * x + m[9, f] * y + m[10, f] * z + m[11, f]


def _transform_normal(p: Singles, m: Singles) -> None:
    """By the cofactors: the inverse transpose times the determinant, without a division; outside stays outside."""
    for f in range(LANES):
        x, y, z = p[0, f], p[1, f], p[2, f]
        cx = m[5, f] * m[10, f] - m[6, f] * m[9, f]
        cy = m[6, f] * m[8, f] - m[4, f] * m[10, f]
        cz = m[4, f] * m[9, f] - m[5, f] * m[8, f]
        volume = m[0, f] * cx + m[1, f] * cy + m[2, f] * cz
        way = -ONE if volume < 0 else ONE
        nx = cx * x + cy * y + cz * z
        ny = (m[2, f] * m[9, f] - m[1, f] * m[10, f]) * x
        ny += (m[0, f] * m[10, f] - m[2, f] * m[8, f]) * y
        ny += (m[1, f] * m[8, f] - m[0, f] * m[9, f]) * z
        nz = (m[1, f] * m[6, f] - m[2, f] * m[5, f]) * x
        nz += (m[2, f] * m[4, f] - m[0, f] * m[6, f]) * y
        nz += (m[0, f] * m[5, f] - m[1, f] * m[4, f]) * z
        p[0, f] = nx * way
        p[1, f] = ny * way
        p[2, f] = nz * way


def _turn(p: Singles, b: Singles) -> None:
    """Turn by quaternions of any length but 0."""
    for f in range(LANES):
        x, y, z, w = b[0, f], b[1, f], b[2, f], b[3, f]
        px, py, pz = p[0, f], p[1, f], p[2, f]
        cx = y * pz - z * py + w * px
        cy = z * px - x * pz + w * py
        cz = x * py - y * px + w * pz
        two = TWO / (x * x + y * y + z * z + w * w)
        p[0, f] = px + two * (y * cz - z * cy)
        p[1, f] = py + two * (z * cx - x * cz)
        p[2, f] = pz + two * (x * cy - y * cx)


def _make_unit(p: Singles) -> None:
    for f in range(LANES):
        x, y, z = p[0, f], p[1, f], p[2, f]
        scale = ONE / max(np.sqrt(x * x + y * y + z * z), TINY)
        p[0, f] = x * scale
        p[1, f] = y * scale
        p[2, f] = z * scale


def _store(tile: Singles, count: int, at: int, out: Singles) -> None:
    for f in range(len(out)):
        frame = out[f]
        for v in range(count):
            frame[at + v, 0] = tile[v, 0, f]
            frame[at + v, 1] = tile[v, 1, f]
            frame[at + v, 2] = tile[v, 2, f]


def normals_of_faces(faces: Ints, positions: Singles, normals: Singles) -> None:
    """Write unit normals of positions (n, V, 3): the sum of the faces' normals, each as long as its area."""
    for f in range(len(positions)):
        p, n = positions[f], normals[f]
        for v in range(len(n)):
            n[v, 0] = n[v, 1] = n[v, 2] = 0
        for t in range(len(faces)):
            a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
            ux, uy, uz = p[b, 0] - p[a, 0], p[b, 1] - p[a, 1], p[b, 2] - p[a, 2]
            vx, vy, vz = p[c, 0] - p[a, 0], p[c, 1] - p[a, 1], p[c, 2] - p[a, 2]
            x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            for corner in (a, b, c):
                n[corner, 0] += x
                n[corner, 1] += y
                n[corner, 2] += z
        for v in range(len(n)):
            length = np.sqrt(n[v, 0] * n[v, 0] + n[v, 1] * n[v, 1] + n[v, 2] * n[v, 2])
            if length > 0:
                n[v, 0] /= length
                n[v, 1] /= length
                n[v, 2] /= length


def shrinkage(weight: Singles, joint: Ints, start: Ints, matrices: Singles, logs: Singles, factors: Singles) -> None:
    """Write det(Σ w A) / Π |det A|^w of vertices into factors (V, n); matrices (J, 12, L), logs (J, L) of |det A|, or
    (0, L) where all are 1."""
    m = np.empty((12, LANES), np.float32)
    found = np.empty(LANES, np.float32)
    size = np.empty(LANES, np.float32)
    for v in range(len(factors)):
        _blend(m, matrices, weight, joint, start[v], start[v + 1])
        for f in range(LANES):
            x = m[5, f] * m[10, f] - m[6, f] * m[9, f]
            y = m[6, f] * m[8, f] - m[4, f] * m[10, f]
            z = m[4, f] * m[9, f] - m[5, f] * m[8, f]
            found[f] = m[0, f] * x + m[1, f] * y + m[2, f] * z
        if len(logs):
            for f in range(LANES):
                size[f] = 0
            for e in range(start[v], start[v + 1]):
                w = weight[e]
                row = logs[joint[e]]
                for f in range(LANES):
                    size[f] += w * row[f]
            for f in range(LANES):
                found[f] *= np.exp(-size[f])
        for f in range(factors.shape[1]):
            factors[v, f] = found[f]
