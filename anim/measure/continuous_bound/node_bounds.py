"""Majorants of node transforms in local and world space, in two versions of a clip."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats
from anim.maths import hierarchy
from anim.measure.continuous_bound.derivative_bounds import product, resting
from anim.measure.continuous_bound.endpoints import endpoints, slide_bounds
from anim.measure.continuous_bound.node_tracks import (
    ClipSpan,
    NodeIntervals,
    columns_of,
    late_nodes,
    moving_nodes,
    pack,
    pair_lengths,
    static_nodes,
    write_pairs,
)
from anim.measure.continuous_bound.rotation_bounds import rotation_bounds
from anim.measure.continuous_bound.rotation_endpoints import rotation_endpoints
from anim.model import Skeleton

UNIT_TOLERANCE = 1e-6  # of |q|²: up to this, players with and without normalization agree


class NodeBounds(NamedTuple):
    """Majorants of N nodes in G intervals, local or world: of matrices and of origins, in m, (3, 2, N, G).

    jumps: (1 or 2, N, G), upper bounds of both versions' jumps of matrices and origins at the end of an interval.
    """

    matrices: Floats
    origins: Floats
    jumps: Floats


def world_bounds(spans: Sequence[ClipSpan], *, players: Sequence[str]) -> NodeBounds:
    """Return the majorants of all nodes in world space, valid for each of the players.

    spans: of clips on the same two skeletons, with equal hierarchies; intervals of one follow those of another.
    players: names in PLAYERS.
    """
    local = local_bounds(spans, players=players)
    skeleton = spans[0].versions[0].skeleton
    found = (_world_of_deep if hierarchy.is_deep(skeleton.levels()) else _world_by_level)(local, skeleton)
    found.jumps[..., ~local.jumps.any(axis=(0, 1))] = 0.0  # where nothing jumps, nan if another bound is unknown
    return found


def _world_by_level(local: NodeBounds, skeleton: Skeleton) -> NodeBounds:
    matrices, origins = np.empty_like(local.matrices), np.empty_like(local.origins)
    jumps = np.zeros((2, *local.jumps.shape[1:]))
    has_jumps = bool(local.jumps.any())
    for depth, nodes in enumerate(skeleton.levels()):
        own, origin, leap = local.matrices[:, :, nodes], local.origins[:, :, nodes], local.jumps[0, nodes]
        if depth == 0:
            matrices[:, :, nodes], origins[:, :, nodes], jumps[0, nodes] = own, origin, leap
            continue
        above = skeleton.parents[nodes]
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


def local_bounds(spans: Sequence[ClipSpan], *, players: Sequence[str]) -> NodeBounds:
    """Return the majorants of all nodes in local space. Parameters as for `world_bounds`."""
    first, second = (version.skeleton for version in spans[0].versions)
    matrices, jumps = _rotations(spans, players)
    scales = _vectors(spans, "scale", _max_norm)
    matrices, jumps = product(matrices, scales), jumps * scales[0, 1]
    origins = _vectors(spans, "translation", _length)
    skewed = first.sheared
    if len(skewed):
        a, b = first.sheared_local, second.sheared_local
        matrices[:, :, skewed] = resting(_norm(a[..., :3]), _norm((b - a)[..., :3]))[..., None]
        origins[:, :, skewed] = resting(_length(a[..., 3].T), _length((b - a)[..., 3].T))[..., None]
    return NodeBounds(matrices, origins, jumps[None])


def _rotations(spans: Sequence[ClipSpan], players: Sequence[str]) -> tuple[Floats, Floats]:
    """Majorants (3, 2, N, G) of all nodes' rotations, and jumps (N, G)."""
    a, b = (version.skeleton.rotation for version in spans[0].versions)
    held, other = _constants(spans, "rotation")
    square = (held * held).sum(axis=0)
    found = _in_intervals(resting(square + np.abs(1 - square)), spans)
    jumps = np.zeros(found.shape[2:])
    differs = (held != other).any(axis=0) | (np.abs(1 - square) > UNIT_TOLERANCE)
    static = map(static_nodes, spans, columns_of(spans), _uneven(spans, differs))
    for some in pack((*_moving(spans, "rotation"), *static)):
        one, another = (
            rotation_endpoints([each.version(k, rest) for each in some], players=players)
            for k, rest in enumerate((a, b))
        )
        bounds, leaps = rotation_bounds(one, another, pair_lengths(some))
        write_pairs(bounds, some, found)
        write_pairs(leaps, some, jumps)
    return found, jumps


def _vectors(spans: Sequence[ClipSpan], path: str, size: Callable[[Floats], Floats]) -> Floats:
    """Majorants (3, 2, N, G) of all nodes' translations or scales."""
    a, b = (getattr(version.skeleton, path) for version in spans[0].versions)
    held, other = _constants(spans, path)
    found = _in_intervals(resting(size(held), size(other - held)), spans)
    for some in pack(_moving(spans, path)):
        one, another = (endpoints([each.version(k, rest) for each in some]) for k, rest in enumerate((a, b)))
        write_pairs(slide_bounds(one, another, pair_lengths(some), size), some, found)
    return found


def _constants(spans: Sequence[ClipSpan], path: str) -> tuple[Floats, Floats]:
    """Constant values (C, N, S) of static nodes in both versions of S clips: of their tracks, or of the rest pose."""
    first, second = (np.stack([each.versions[k].constant_values(path) for each in spans], axis=-1) for k in (0, 1))
    return np.swapaxes(first, 0, 1), np.swapaxes(second, 0, 1)


def _in_intervals(found: Floats, spans: Sequence[ClipSpan]) -> Floats:
    """Bounds of clips (..., S) for all of their intervals (..., G)."""
    return np.repeat(found, [len(each.where) for each in spans], axis=-1)


def _uneven(spans: Sequence[ClipSpan], differs: Bools) -> list[set[int]]:
    """Nodes of each clip whose rotations differ between versions (N, S) or between players, even if constant."""
    return [{*np.flatnonzero(some).tolist(), *late_nodes(each)} for each, some in zip(spans, differs.T, strict=True)]


def _moving(spans: Sequence[ClipSpan], path: str) -> Iterator[NodeIntervals]:
    for each, columns in zip(spans, columns_of(spans), strict=True):
        yield from moving_nodes(each, path, columns)


def _length(vectors: Floats) -> Floats:
    return np.asarray(np.sqrt((vectors * vectors).sum(axis=0)))


def _max_norm(vectors: Floats) -> Floats:
    return np.asarray(np.abs(vectors).max(axis=0))


def _norm(matrices: Floats) -> Floats:
    return np.asarray(np.linalg.norm(matrices, 2, axis=(-1, -2)))
