"""Substeps of cloth by extended position-based dynamics (XPBD), compiled.

Source: Macklin, Müller, Chentanez, XPBD, 2016; with substeps instead of iterations: Macklin et al., Small Steps in
Physics Simulation, 2019. Tethers: Kim, Chentanez, Müller-Fischer, Long Range Attachments, 2012.
"""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats, Ints
from anim.simulation.cloth.kernels.self_collision import separate_points
from anim.skinning.kernels.jit import jit


@jit
def project_distances(p: Floats, w: Floats, pairs: Ints, rest: Floats, compliance: float, multipliers: Floats) -> None:
    """Move pairs (E, 2) of points towards their rest distances (E,), in order: Gauss-Seidel.

    p: (P, 3) m, changed. w: (P,) inverse masses 1/kg. compliance: of all, m/N, over the squared step. multipliers:
    (E,) Lagrange multipliers of this step, changed; 0 before its first sweep.
    """
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        dx, dy, dz = p[i, 0] - p[j, 0], p[i, 1] - p[j, 1], p[i, 2] - p[j, 2]
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        total = w[i] + w[j]
        if total == 0.0 or length == 0.0:
            continue
        change = -(length - rest[k] + compliance * multipliers[k]) / (total + compliance)
        multipliers[k] += change
        s = change / length
        p[i, 0] += s * w[i] * dx
        p[i, 1] += s * w[i] * dy
        p[i, 2] += s * w[i] * dz
        p[j, 0] -= s * w[j] * dx
        p[j, 1] -= s * w[j] * dy
        p[j, 2] -= s * w[j] * dz


@jit
def limit_tethers(p: Floats, w: Floats, anchors: Ints, limits: Floats) -> None:
    """Pull points back that are farther from their anchor than its length along the mesh; anchor −1 for none."""
    for i in range(len(p)):
        a = anchors[i]
        if a < 0 or w[i] == 0.0:
            continue
        dx, dy, dz = p[i, 0] - p[a, 0], p[i, 1] - p[a, 1], p[i, 2] - p[a, 2]
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        if length > limits[i]:
            s = limits[i] / length
            p[i, 0] = p[a, 0] + s * dx
            p[i, 1] = p[a, 1] + s * dy
            p[i, 2] = p[a, 2] + s * dz


@jit
def add_wind(v: Floats, p: Floats, w: Floats, faces: Ints, wind: Floats, air: float, h: float) -> None:
    """Add the pressure of the air on both sides of each face: ½ ρ A |u·n| (u·n) n, u being the wind past the face."""
    for k in range(len(faces)):
        a, b, c = faces[k, 0], faces[k, 1], faces[k, 2]
        ux, uy, uz = p[b, 0] - p[a, 0], p[b, 1] - p[a, 1], p[b, 2] - p[a, 2]
        vx, vy, vz = p[c, 0] - p[a, 0], p[c, 1] - p[a, 1], p[c, 2] - p[a, 2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        double_area = np.sqrt(nx * nx + ny * ny + nz * nz)
        if double_area == 0.0:
            continue
        nx, ny, nz = nx / double_area, ny / double_area, nz / double_area
        past = (
            (wind[0] - (v[a, 0] + v[b, 0] + v[c, 0]) / 3.0) * nx
            + (wind[1] - (v[a, 1] + v[b, 1] + v[c, 1]) / 3.0) * ny
            + (wind[2] - (v[a, 2] + v[b, 2] + v[c, 2]) / 3.0) * nz
        )
        impulse = 0.5 * air * 0.5 * double_area * abs(past) * past * h / 3.0
        mass = 3.0 / max(w[a] + w[b] + w[c], 1e-300)  # harmonic mean: no more than stops the face in this step
        impulse = min(abs(impulse), mass * abs(past)) * (1.0 if past > 0 else -1.0)
        for i in (a, b, c):
            v[i, 0] += impulse * w[i] * nx
            v[i, 1] += impulse * w[i] * ny
            v[i, 2] += impulse * w[i] * nz


@jit
def push_out(
    p: Floats, old: Floats, w: Floats, capsules: Floats, before: Floats, floor: float, thickness: float, friction: float
) -> None:
    """Move points out of capsules (C, 7: both centers, radius) and above the floor, with Coulomb-like friction.

    old: positions at the start of the step; before: the capsules then, so that friction drags points along.
    """
    for i in range(len(p)):
        if w[i] == 0.0:
            continue
        for k in range(len(capsules)):
            ax, ay, az = capsules[k, 0], capsules[k, 1], capsules[k, 2]
            bx, by, bz = capsules[k, 3] - ax, capsules[k, 4] - ay, capsules[k, 5] - az
            square = bx * bx + by * by + bz * bz
            t = 0.0
            if square > 0.0:
                t = ((p[i, 0] - ax) * bx + (p[i, 1] - ay) * by + (p[i, 2] - az) * bz) / square
                t = min(max(t, 0.0), 1.0)
            cx, cy, cz = ax + t * bx, ay + t * by, az + t * bz
            dx, dy, dz = p[i, 0] - cx, p[i, 1] - cy, p[i, 2] - cz
            length = np.sqrt(dx * dx + dy * dy + dz * dz)
            reach = capsules[k, 6] + thickness
            if length >= reach:
                continue
            if length == 0.0:
                dx, dy, dz, length = 0.0, 1.0, 0.0, 1.0
                depth = reach
            else:
                depth = reach - length
            nx, ny, nz = dx / length, dy / length, dz / length
            p[i, 0] += nx * depth
            p[i, 1] += ny * depth
            p[i, 2] += nz * depth
            mx = cx - (before[k, 0] + t * (before[k, 3] - before[k, 0]))
            my = cy - (before[k, 1] + t * (before[k, 4] - before[k, 1]))
            mz = cz - (before[k, 2] + t * (before[k, 5] - before[k, 2]))
            sx, sy, sz = p[i, 0] - old[i, 0] - mx, p[i, 1] - old[i, 1] - my, p[i, 2] - old[i, 2] - mz
            along = sx * nx + sy * ny + sz * nz
            sx, sy, sz = sx - along * nx, sy - along * ny, sz - along * nz
            slip = np.sqrt(sx * sx + sy * sy + sz * sz)
            if slip > 0.0:
                s = min(1.0, friction * depth / slip)
                p[i, 0] -= s * sx
                p[i, 1] -= s * sy
                p[i, 2] -= s * sz
        depth = floor + thickness - p[i, 1]
        if depth > 0.0:
            p[i, 1] += depth
            sx, sz = p[i, 0] - old[i, 0], p[i, 2] - old[i, 2]
            slip = np.sqrt(sx * sx + sz * sz)
            if slip > 0.0:
                s = min(1.0, friction * depth / slip)
                p[i, 0] -= s * sx
                p[i, 2] -= s * sz


@jit
def step_frame(
    p: Floats,
    v: Floats,
    w: Floats,
    pinned: Ints,
    targets: Floats,
    edges: Ints,
    edge_lengths: Floats,
    hinges: Ints,
    hinge_lengths: Floats,
    anchors: Ints,
    limits: Floats,
    faces: Ints,
    capsules: Floats,
    wind: Floats,
    at_rest: Floats,
    numbers: Floats,
    iterations: int,
) -> None:
    """Advance positions and velocities (P, 3) in place by S substeps.

    pinned: (N,) indices of points that go to targets (S, N, 3). capsules: (S + 1, C, 7), from the end of the step
    before. wind: (S, 3) m/s. at_rest: (P, 3), for pairs that self-collision leaves alone. numbers: substep s, gravity
    x, y, z m/s², compliance of edges and of hinges m/N, damping 1/s, density of air kg/m³, floor m, thickness m,
    friction, self-collision thickness m or 0. iterations: of the constraints in each substep.
    """
    h, damping, air = numbers[0], numbers[6], numbers[7]
    floor, thickness, friction, own = numbers[8], numbers[9], numbers[10], numbers[11]
    stretch, bend = numbers[4] / (h * h), numbers[5] / (h * h)
    keep = 1.0 - min(1.0, damping * h)
    old = np.empty_like(p)
    edge_multipliers, hinge_multipliers = np.empty(len(edges)), np.empty(len(hinges))
    for s in range(len(targets)):
        old[:] = p
        edge_multipliers[:] = 0.0
        hinge_multipliers[:] = 0.0
        for i in range(len(p)):
            if w[i] > 0.0:
                for c in range(3):  # damped before gravity, which else would sag less
                    v[i, c] = v[i, c] * keep + h * numbers[1 + c]
        if air > 0.0:
            add_wind(v, p, w, faces, wind[s], air, h)
        for i in range(len(p)):
            if w[i] > 0.0:
                for c in range(3):
                    p[i, c] += h * v[i, c]
        for k in range(len(pinned)):
            for c in range(3):
                p[pinned[k], c] = targets[s, k, c]
        for _ in range(iterations):
            project_distances(p, w, edges, edge_lengths, stretch, edge_multipliers)
            project_distances(p, w, hinges, hinge_lengths, bend, hinge_multipliers)
        limit_tethers(p, w, anchors, limits)
        if own > 0.0 and s % 2 == 0:
            separate_points(p, w, at_rest, own)
        push_out(p, old, w, capsules[s + 1], capsules[s], floor, thickness, friction)
        for i in range(len(p)):
            for c in range(3):
                v[i, c] = (p[i, c] - old[i, c]) / h
