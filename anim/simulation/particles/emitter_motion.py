"""Places, directions and velocities of emitters at the births of their particles: nodes, or surfaces of meshes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import chain

import numpy as np

from anim.arrays import Floats, Ints
from anim.errors import NotFoundError
from anim.model import Clip, Interpolation, Scene, Skeleton
from anim.model.skeleton import ancestors, nearest_ancestors, node_mask
from anim.simulation.particles.node_motion import NodeMotion
from anim.skinning.bake import bake

VELOCITY_STEP_S = 1e-3  # half the interval of the difference quotient of an emitter's motion
MAX_MATRICES = 1 << 17  # of emitters, in memory at once


def sample_nodes(
    scene: Scene, clip: Clip, nodes: Sequence[int], times: Floats, direction: Sequence[float]
) -> tuple[Floats, Floats, Floats]:
    """Return world positions m, unit directions and velocities m/s of E nodes at times (n,) s, all (E · n, 3).

    direction: (3,) in the space of each node. The emitters of one time are evaluated together: a pose of N nodes for
    each of them would take E times as long.
    """
    at = _around(times, clip)
    motion, unit = NodeMotion(scene.skeleton, clip), np.asarray(direction) / np.linalg.norm(direction)
    positions, axes = np.empty((len(nodes), len(times), 3, 3)), np.empty((len(nodes), len(times), 3))
    num_times = max(1, MAX_MATRICES // (3 * max(len(nodes), 1)))
    for first in range(0, len(times), num_times):
        chunk = slice(first, first + num_times)
        unique, inverse = np.unique(at[chunk], return_inverse=True)
        matrices = np.moveaxis(motion.at(unique, nodes)[inverse.reshape(at[chunk].shape)], 2, 0)
        axes[:, chunk] = matrices[:, :, 1, :, :3] @ unit
        positions[:, chunk] = matrices[:, :, :, :, 3]
    velocities = np.empty((len(nodes), len(times), 3))
    for jumps, rows in _rows_by_jumps(clip, scene.skeleton, nodes):
        found = _velocity(np.tile(at, (len(rows), 1)), positions[rows].reshape(-1, 3, 3), jumps)
        velocities[rows] = found.reshape(len(rows), -1, 3)
    return positions[:, :, 1].reshape(-1, 3), unit_vectors(axes.reshape(-1, 3)), velocities.reshape(-1, 3)


def sample_surfaces(
    scene: Scene, clip: Clip, nodes: Sequence[int], times: Floats, random: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return points of E nodes' skinned meshes at times (n,) s, their normals, and their velocities, all (E · n, 3).

    random: (E, 3, n), uniform in 0 … 1. Raises NotFoundError for a node without a surface.
    """
    meshes = {each.node: each.mesh for each in reversed(scene.instances)}  # the first of each node
    for node in nodes:
        if node not in meshes or not len(meshes[node].faces):
            raise NotFoundError(f"node '{scene.skeleton.names[node]}' has no surface to emit from")
    at = _around(times, clip)
    jumps = _sorted(chain.from_iterable(_times_of_steps(clip).values()))
    corners_of_faces, weights = [], []
    for node, (height, first, second) in zip(nodes, random, strict=True):
        faces, corners = meshes[node].faces, meshes[node].positions[meshes[node].faces]
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        corners_of_faces.append(faces[np.searchsorted(np.cumsum(areas) / areas.sum(), height)])
        u, v = np.sqrt(first), second
        weights.append(np.stack([1 - u, u * (1 - v), u * v], axis=1))
    points = _vertices(scene, clip, nodes, at, np.array(corners_of_faces)).reshape(3, -1, 3, 3)
    barycentric = np.concatenate(weights)[:, :, None]
    positions = np.stack([(barycentric * each).sum(axis=1) for each in points], axis=1)
    normals = np.cross(points[1][:, 1] - points[1][:, 0], points[1][:, 2] - points[1][:, 0])
    velocities = _velocity(np.tile(at, (len(nodes), 1)), positions, jumps)
    return positions[:, 1], unit_vectors(normals), velocities


def unit_vectors(vectors: Floats) -> Floats:
    """Return vectors (n, 3) divided by their lengths; those without a length stay."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300))


def _around(times: Floats, clip: Clip) -> Floats:
    """Times before, at and after births (n, 3), for the difference quotient."""
    at: Floats = np.maximum(times[:, None] + np.array([-VELOCITY_STEP_S, 0.0, VELOCITY_STEP_S]), clip.start)
    return at


def _rows_by_jumps(clip: Clip, skeleton: Skeleton, nodes: Sequence[int]) -> list[tuple[Floats, Ints]]:
    """Groups of nodes, as rows in them, with the sorted times at which a STEP track makes their positions jump.

    Such a track is one of the node, or of a node above it.
    """
    times = _times_of_steps(clip)
    if not times:
        return [(np.empty(0), np.arange(len(nodes)))]
    has_steps = node_mask(skeleton, times)
    above = nearest_ancestors(skeleton.parents, has_steps)
    owners = np.array([node if has_steps[node] else above[node] for node in nodes], np.int64)
    result = []
    for owner in np.unique(owners):
        moving = [] if owner < 0 else [int(owner), *ancestors(above, int(owner))]
        result.append((_sorted(chain.from_iterable(times[each] for each in moving)), np.flatnonzero(owners == owner)))
    return result


def _times_of_steps(clip: Clip) -> dict[int | None, list[Floats]]:
    """Key times of the STEP tracks by node: there a position can jump."""
    found: dict[int | None, list[Floats]] = {}
    for track in clip.tracks:
        if track.interpolation is Interpolation.STEP:
            found.setdefault(track.node, []).append(track.times)
    return found


def _sorted(times: Iterable[Floats]) -> Floats:
    found: Floats = np.unique(np.concatenate([np.empty(0), *times]))
    return found


def _velocity(at: Floats, positions: Floats, jumps: Floats) -> Floats:
    """Velocities (n, 3) at the second of three times (n, 3), from positions (n, 3, 3); a jump is no velocity.

    With a jump before or after, the difference is one of the other half; with jumps in both it is 0.
    """
    counts = np.searchsorted(jumps, at, side="right")
    is_smooth = counts[:, 1:] == counts[:, :-1]  # (n, 2)
    steps = np.where(is_smooth[:, :, None], np.diff(positions, axis=1), 0.0)
    span = np.where(is_smooth, np.diff(at, axis=1), 0.0).sum(axis=1)
    return np.asarray(steps.sum(axis=1) / np.maximum(span, 1e-9)[:, None])


def _vertices(scene: Scene, clip: Clip, nodes: Sequence[int], times: Floats, chosen: Ints) -> Floats:
    """Positions (3, E, n, 3, 3) of E meshes' vertices (E, n, 3), at each column of times (n, 3).

    One bake of all meshes: a pose of N nodes for each of them would take E times as long.
    """
    unique, inverse = np.unique(times, return_inverse=True)
    rows = inverse.reshape(times.shape)
    cache = bake(scene, clip, times=unique, rigid=True, nodes=sorted(set(nodes)))
    first_vertex = {part.node: part.vertices[0] for part in reversed(cache.parts)}
    vertices = chosen + np.array([first_vertex[node] for node in nodes])[:, None, None]
    result = np.empty((times.shape[1], *chosen.shape, 3))
    for chunk in cache.chunks():
        for column, row in enumerate(rows.T):
            here = np.flatnonzero((row >= chunk.first) & (row < chunk.first + len(chunk.positions)))
            result[column][:, here] = chunk.positions[(row[here] - chunk.first)[:, None], vertices[:, here]]
    return result
