"""Majorants of node transforms in local and world space, in two versions of a clip."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import hierarchy
from anim.measure.continuous_bound.derivative_bounds import product, resting
from anim.measure.continuous_bound.endpoints import endpoints, slide_bounds
from anim.measure.continuous_bound.intervals import Intervals
from anim.measure.continuous_bound.rotation_bounds import rotation_bounds
from anim.measure.continuous_bound.rotation_endpoints import rotation_endpoints
from anim.measure.continuous_bound.track_partition import ClipVersion, node_block, pick_tracks
from anim.model import Skeleton
from anim.sampling.batch import Batch

UNIT_TOLERANCE = 1e-6  # of |q|²: up to this, players with and without normalization agree


class NodeBounds(NamedTuple):
    """Majorants of N nodes in G intervals, local or world: of matrices and of origins, in m, (3, 2, N, G).

    jumps: (1 or 2, N, G), upper bounds of both versions' jumps of matrices and origins at the end of an interval.
    """

    matrices: Floats
    origins: Floats
    jumps: Floats


def world_bounds(first: ClipVersion, second: ClipVersion, where: Intervals, *, players: Sequence[str]) -> NodeBounds:
    """Return the majorants of all nodes in world space, valid for each of the players.

    Both versions have the same hierarchy. players: names in PLAYERS.
    """
    local = local_bounds(first, second, where, players=players)
    if hierarchy.is_deep(first.skeleton.levels()):
        return _world_of_deep(local, first.skeleton)
    matrices, origins = np.empty_like(local.matrices), np.empty_like(local.origins)
    jumps = np.zeros((2, *local.jumps.shape[1:]))
    has_jumps = bool(local.jumps.any())
    for depth, nodes in enumerate(first.skeleton.levels()):
        own, origin, leap = local.matrices[:, :, nodes], local.origins[:, :, nodes], local.jumps[0, nodes]
        if depth == 0:
            matrices[:, :, nodes], origins[:, :, nodes], jumps[0, nodes] = own, origin, leap
            continue
        above = first.skeleton.parents[nodes]
        parent = matrices[:, :, above]
        matrices[:, :, nodes] = product(parent, own)
        origins[:, :, nodes] = origins[:, :, above] + product(parent, origin)
        if has_jumps:
            jumps[0, nodes] = jumps[0, above] * (own[0, 1] + leap) + parent[0, 1] * leap
            jumps[1, nodes] = jumps[1, above] + jumps[0, above] * origin[0, 1]
    return NodeBounds(matrices, origins, jumps)


def _world_of_deep(local: NodeBounds, skeleton: Skeleton) -> NodeBounds:
    """The same in few steps: majorants of paths are products of those of their parts."""
    count, intervals = local.matrices.shape[2:]
    rows = [np.moveaxis(each, 2, 0).reshape(count, 6, intervals) for each in (local.matrices, local.origins)]
    parts = np.concatenate((*rows, local.jumps[0][:, None], np.zeros((count, 1, intervals))), axis=1)
    found = hierarchy.accumulate(parts, skeleton.parents, skeleton.levels(), _join_paths)
    return NodeBounds(_majorants(found, 0), _majorants(found, 6), np.moveaxis(found[:, 12:], 1, 0))


def _join_paths(above: Floats, below: Floats) -> Floats:
    """Majorants (M, 14, G) of matrix (6), origin (6), and their jumps, of two paths one after the other."""
    parent, own, origin = _majorants(above, 0), _majorants(below, 0), _majorants(below, 6)
    jump, leap = above[:, 12], below[:, 12]
    found = np.empty(above.shape)
    found[:, :6] = np.moveaxis(product(parent, own), 2, 0).reshape(len(found), 6, -1)
    found[:, 6:12] = above[:, 6:12] + np.moveaxis(product(parent, origin), 2, 0).reshape(len(found), 6, -1)
    found[:, 12] = jump * (own[0, 1] + leap) + parent[0, 1] * leap
    found[:, 13] = above[:, 13] + jump * origin[0, 1] + (parent[0, 1] + jump) * below[:, 13]
    return found


def _majorants(parts: Floats, at: int) -> Floats:
    """Six rows of parts (M, 14, G) as majorants (3, 2, M, G)."""
    return np.moveaxis(parts[:, at : at + 6].reshape(len(parts), 3, 2, -1), 0, 2)


def local_bounds(first: ClipVersion, second: ClipVersion, where: Intervals, *, players: Sequence[str]) -> NodeBounds:
    """Return the majorants of all nodes in local space. Parameters as for `world_bounds`."""
    matrices, jumps = _rotations(first, second, where, players)
    scales = _vectors(first, second, where, "scale", _max_norm)
    matrices, jumps = product(matrices, scales), jumps * scales[0, 1]
    origins = _vectors(first, second, where, "translation", _length)
    skewed = first.skeleton.sheared
    if len(skewed):
        a, b = first.skeleton.sheared_local, second.skeleton.sheared_local
        matrices[:, :, skewed] = resting(_norm(a[..., :3]), _norm((b - a)[..., :3]))[..., None]
        origins[:, :, skewed] = resting(_length(a[..., 3].T), _length((b - a)[..., 3].T))[..., None]
    return NodeBounds(matrices, origins, jumps[None])


def _rotations(
    first: ClipVersion, second: ClipVersion, where: Intervals, players: Sequence[str]
) -> tuple[Floats, Floats]:
    """Majorants (3, 2, N, G) of all nodes' rotations, and jumps (N, G)."""
    a, b = first.skeleton.rotation, second.skeleton.rotation
    held, other = _held(first, "rotation"), _held(second, "rotation")
    square = (held * held).sum(axis=1)
    found = np.repeat(resting(square + np.abs(1 - square))[..., None], len(where), axis=-1)
    jumps = np.zeros(found.shape[2:])
    differs = (held != other).any(axis=1) | (np.abs(1 - square) > UNIT_TOLERANCE)
    uneven = set(np.flatnonzero(differs).tolist()) | _late(first, where) | _late(second, where)
    for nodes, tracks, gaps in _groups(first, second, "rotation", where, uneven):
        place = {node: i for i, node in enumerate(nodes.tolist())}
        some, leaps = rotation_bounds(
            rotation_endpoints(a[nodes], tracks[0], place, gaps, players=players),
            rotation_endpoints(b[nodes], tracks[1], place, gaps, players=players),
            gaps.lengths,
        )
        found[:, :, nodes], jumps[nodes] = np.swapaxes(some, -1, -2), leaps.T
    return found, jumps


def _vectors(
    first: ClipVersion, second: ClipVersion, where: Intervals, path: str, size: Callable[[Floats], Floats]
) -> Floats:
    """Majorants (3, 2, N, G) of all nodes' translations or scales."""
    a, b = getattr(first.skeleton, path), getattr(second.skeleton, path)
    held, other = _held(first, path), _held(second, path)
    found = np.repeat(resting(size(held.T), size((other - held).T))[..., None], len(where), axis=-1)
    for nodes, tracks, gaps in _groups(first, second, path, where):
        place = {node: i for i, node in enumerate(nodes.tolist())}
        both = endpoints(a[nodes], tracks[0], place, gaps), endpoints(b[nodes], tracks[1], place, gaps)
        found[:, :, nodes] = np.swapaxes(slide_bounds(*both, gaps.lengths, size), -1, -2)
    return found


def _held(version: ClipVersion, path: str) -> Floats:
    """Constant values (N, C) of static nodes: of their tracks, or of the rest pose."""
    values: Floats = getattr(version.skeleton, path).copy()
    for batch in _of_path(version.still, path):
        values[[track.node for track in batch.tracks if track.node is not None]] = batch.values[0]
    return values


def _late(version: ClipVersion, where: Intervals) -> set[int]:
    """Nodes with a constant rotation after the first interval: some players normalize only from then on."""
    late = [batch for batch in _of_path(version.still, "rotation") if batch.times[-1] > where.edges[1]]
    return _nodes(late)


def _groups(
    first: ClipVersion, second: ClipVersion, path: str, where: Intervals, uneven: Collection[int] = ()
) -> Iterator[tuple[Ints, tuple[list[Batch], list[Batch]], Intervals]]:
    """Nodes that move in either version, by blocks, with tracks and all intervals; then the others of `uneven`.

    The latter with one interval, since all are equal.
    """
    moving = (_of_path(first.moving, path), _of_path(second.moving, path))
    movers = _nodes(*moving)
    for block in sorted({node_block(batch) for side in moving for batch in side}):
        one, other = ([batch for batch in side if node_block(batch) == block] for side in moving)
        yield np.array(sorted(_nodes(one, other)), np.int64), (one, other), where
    if others := set(uneven) - movers:
        still = [_of_nodes(_of_path(version.still, path), others) for version in (first, second)]
        yield np.array(sorted(others), np.int64), (still[0], still[1]), where.first


def _of_nodes(tracks: list[Batch], nodes: Collection[int]) -> list[Batch]:
    """The tracks of some nodes."""
    chosen = [(batch, np.array([track.node in nodes for track in batch.tracks])) for batch in tracks]
    return [pick_tracks(batch, some) for batch, some in chosen if some.any()]


def _of_path(tracks: list[Batch], path: str) -> list[Batch]:
    return [batch for batch in tracks if batch.path == path]


def _nodes(*tracks: list[Batch]) -> set[int]:
    return {track.node for side in tracks for batch in side for track in batch.tracks if track.node is not None}


def _length(vectors: Floats) -> Floats:
    return np.asarray(np.sqrt((vectors * vectors).sum(axis=0)))


def _max_norm(vectors: Floats) -> Floats:
    return np.asarray(np.abs(vectors).max(axis=0))


def _norm(matrices: Floats) -> Floats:
    return np.asarray(np.linalg.norm(matrices, 2, axis=(-1, -2)))
