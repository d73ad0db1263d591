"""Substeps of cloth by extended position-based dynamics (XPBD), compiled.

Source: Macklin, Müller, Chentanez, XPBD, 2016; with substeps instead of iterations: Macklin et al., Small Steps in
Physics Simulation, 2019.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from anim.arrays import Floats, Ints
from anim.simulation.cloth.kernels.collisions import push_out
from anim.simulation.cloth.kernels.constraints import (
    find_longest,
    limit_elongation,
    limit_tethers,
    project_distances,
    shorten_pairs,
)
from anim.simulation.cloth.kernels.self_collision import separate_points
from anim.simulation.cloth.kernels.wind import add_wind
from anim.skinning.kernels.jit import jit

REPEATED_LEVELS = 2  # finest levels of distant pairs, once more before the limits of edges


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
    distant: NDArray[np.int32],
    distances: Floats,
    levels: Ints,
    outward: Ints,
    most: Floats,
    order: Ints,
    faces: Ints,
    colliders: Floats,
    wind: Floats,
    at_rest: Floats,
    numbers: Floats,
    iterations: int,
    limit_sweeps: int,
    longest: Ints,
    elongation: Floats,
) -> float:
    """Advance positions and velocities (P, 3) in place by S substeps; return the elastic energy in J at their end.

    pinned: (N,) indices of points that go to targets (S, N, 3). anchors, limits: (P, K), see `limit_tethers`.
    distant: (D, 2) pairs and their longest distances (D,), on levels that begin at `levels` (L + 1,). outward: (E, 2)
    edges in another order, most: their longest lengths, order: see `limit_elongation`. colliders: (S + 1, C, 8), from
    the end of the step before, see `push_out`. wind: (S, 3) m/s. at_rest: (P, 3), for pairs that self-collision
    leaves alone. numbers: substep s, gravity x, y, z m/s², compliance of edges and of hinges m/N, damping 1/s, density
    of air kg/m³, floor m, thickness m, friction, self-collision thickness m or 0. iterations: of the constraints in
    each substep. limit_sweeps: at most so many of `limit_elongation`, until no edge is too long: fine meshes need all
    of them, having more edges of which one may be, so nothing else is repeated with them. longest, elongation:
    (S, 2), filled with `find_longest` at the end of each substep.
    """
    h, damping, air = numbers[0], numbers[6], numbers[7]
    floor, thickness, friction, own = numbers[8], numbers[9], numbers[10], numbers[11]
    stretch, bend = numbers[4] / (h * h), numbers[5] / (h * h)
    keep = 1.0 - min(1.0, damping * h)
    old = np.empty_like(p)
    edge_multipliers, hinge_multipliers = np.zeros(len(edges)), np.zeros(len(hinges))
    for s in range(len(targets)):
        for i in range(len(p)):
            for c in range(3):  # assignment of the whole array would compile the words of its error: two seconds
                old[i, c] = p[i, c]
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
        push_out(p, old, w, colliders[s + 1], colliders[s], floor, thickness, friction)  # and again at the end
        limit_tethers(p, w, anchors, limits)
        shorten_pairs(p, w, distant, distances, 0, len(distant))
        for _ in range(iterations):
            project_distances(p, w, edges, edge_lengths, stretch, edge_multipliers)
            project_distances(p, w, hinges, hinge_lengths, bend, hinge_multipliers)
        if limit_sweeps > 0:
            shorten_pairs(p, w, distant, distances, levels[-1 - min(REPEATED_LEVELS, len(levels) - 1)], len(distant))
        for _ in range(limit_sweeps):
            if not limit_elongation(p, w, outward, most, order, stretch, edge_multipliers):
                break
        if own > 0.0 and s % 2 == 0:
            separate_points(p, w, at_rest, own)
        push_out(p, old, w, colliders[s + 1], colliders[s], floor, thickness, friction)
        for i in range(len(p)):
            for c in range(3):
                v[i, c] = (p[i, c] - old[i, c]) / h
        find_longest(p, w, edges, edge_lengths, longest[s], elongation[s])
    energy = 0.0
    for k in range(len(edges)):  # ½ compliance · force², and the force is the multiplier / h²
        energy += 0.5 * stretch * edge_multipliers[k] * edge_multipliers[k] / (h * h)
    for k in range(len(hinges)):
        energy += 0.5 * bend * hinge_multipliers[k] * hinge_multipliers[k] / (h * h)
    return energy
