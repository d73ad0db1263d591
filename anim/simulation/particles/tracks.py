"""Paths of particles → tracks of nodes. A node carries one particle after another, and has no size between them."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, Ints
from anim.model import Interpolation, Track
from anim.sampling.times import distinct_float32
from anim.simulation.particles.solver import ParticleKeys

MIN_PAUSE_S = 1e-3  # between the death of a particle and the birth of the next in its node


@dataclass(frozen=True, slots=True, eq=False)
class ParticlePath:
    """Keys of one particle: times (K,) s, positions (K, 3) m, in_velocities and out_velocities (K, 3) m/s; K ≥ 2."""

    times: Floats
    positions: Floats
    in_velocities: Floats
    out_velocities: Floats


def split_paths(keys: ParticleKeys, start: float = 0.0) -> list[ParticlePath]:
    """Return the path of each particle with at least two keys, ordered by birth; times are exact in float32.

    start: s, of the clip: the time of the simulation's 0.

    Of keys that fall together in float32 the first keeps its place, with the last one's velocity after it.
    """
    starts = np.flatnonzero(np.diff(keys.particles, prepend=-1))
    times = start + keys.times
    stored = times.astype(np.float32)
    rounded = stored.astype(np.float64)
    falls = np.cumsum(np.append(0, np.diff(stored) <= 0))  # up to each key
    paths = []
    for first, last in zip(starts.tolist(), [*starts[1:].tolist(), len(times)], strict=True):
        rows: slice | Ints = slice(first, last)  # no array: copies of 100 000 short paths would be most of the time
        ends = rows
        if falls[last - 1] > falls[first]:
            kept = first + distinct_float32(times[first:last])
            rows, ends = kept, np.append(kept[1:], last) - 1
        path = ParticlePath(rounded[rows], keys.positions[rows], keys.in_velocities[rows], keys.out_velocities[ends])
        if len(path.times) >= 2:
            paths.append(path)
    return sorted(paths, key=lambda path: float(path.times[0]))


def share_nodes(paths: Sequence[ParticlePath]) -> list[list[ParticlePath]]:
    """Return the paths by node: the fewest nodes of which none carries two particles at once."""
    free: list[tuple[float, int]] = []
    nodes: list[list[ParticlePath]] = []
    for path in paths:
        if free and free[0][0] + MIN_PAUSE_S <= path.times[0]:
            _, index = heapq.heappop(free)
        else:
            index = len(nodes)
            nodes.append([])
        nodes[index].append(path)
        heapq.heappush(free, (float(path.times[-1]), index))
    return nodes


def make_tracks(
    node: int, paths: Sequence[ParticlePath], size: float, end: float, start: float = 0.0
) -> tuple[Track, Track]:
    """Return the translation and the scale track of a node: cubics along the paths, steps at births and deaths.

    start, end: of the clip, in seconds; particles that live until its end keep their size.
    """
    times = np.concatenate([path.times for path in paths])
    in_tangents = np.concatenate([path.in_velocities for path in paths])
    out_tangents = np.concatenate([path.out_velocities for path in paths])
    for first in np.cumsum([0, *(len(path.times) for path in paths[:-1])]):
        in_tangents[first] = 0.0
        out_tangents[first - 1] = 0.0
    positions = np.concatenate([path.positions for path in paths])
    cubic = Interpolation.CUBICSPLINE
    translation = Track(node, "translation", cubic, times, positions, in_tangents, out_tangents)
    edges = np.array([edge for path in paths for edge in (path.times[0], path.times[-1])])
    sizes = np.tile([size, 0.0], len(paths))
    if edges[-1] >= np.float32(end):
        edges, sizes = edges[:-1], sizes[:-1]
    if edges[0] > np.float32(start):
        edges, sizes = np.insert(edges, 0, start), np.insert(sizes, 0, 0.0)
    scale = Track(node, "scale", Interpolation.STEP, edges, np.repeat(sizes[:, None], 3, axis=1))
    return translation, scale


def octahedron() -> tuple[Floats, Ints]:
    """Return vertices (6, 3) at distance 1, which are also the normals, and faces (8, 3)."""
    corners = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    faces = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    return corners, faces
