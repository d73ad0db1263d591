"""The two versions of a clip, their tracks sorted by what moves."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.model import Clip, Scene, Skeleton, Track
from anim.sampling.lazy_batch import LazyBatch, lazy_batches

BLOCK_NODES = 2048  # of moving nodes bounded at a time


class ClipVersion(NamedTuple):
    """One version: nodes at rest, tracks of nodes that move in either, constant tracks with one key each.

    In batches, moving ones by blocks of nodes too, for memory.
    """

    skeleton: Skeleton
    moving: list[LazyBatch]
    still: list[LazyBatch]

    def nodes(self, path: str) -> set[int]:
        """Return the nodes with moving tracks of a path."""
        return {node for batch in self.moving if batch.path == path for node in nodes_of(batch)}

    def moving_blocks(self, path: str) -> dict[int, list[LazyBatch]]:
        """Return the moving tracks of a path by block of nodes."""
        found: dict[int, list[LazyBatch]] = {}
        for batch in self.moving:
            if batch.path == path:
                found.setdefault(nodes_of(batch)[0] // BLOCK_NODES, []).append(batch)
        return found

    def constant_values(self, path: str) -> Floats:
        """Return the constant values (N, C) of static nodes: of their tracks, or of the rest pose."""
        values: Floats = getattr(self.skeleton, path).copy()
        for batch in self.still:
            if batch.path == path:
                values[nodes_of(batch)] = batch.whole.values[0]
        return values

    def still_tracks(self, path: str, nodes: Ints) -> list[LazyBatch]:
        """Return the constant tracks of some nodes (U,)."""
        wanted = set(nodes.tolist())
        chosen = [(b, np.array([n in wanted for n in nodes_of(b)])) for b in self.still if b.path == path]
        return [batch.pick(some) for batch, some in chosen if some.any()]

    def weights(self, node: int, count: int) -> list[LazyBatch]:
        """Return the track of a node's `count` morph weights, if it has one."""
        all_ = (track for batch in (*self.moving, *self.still) for track in batch.tracks if batch.path == "weights")
        return lazy_batches(track for track in all_ if track.node == node and track.values.shape[1] == count)


def nodes_of(batch: LazyBatch) -> list[int]:
    """Return the nodes of a batch's tracks."""
    return [track.node for track in batch.tracks if track.node is not None]


def partition_tracks(scenes: tuple[Scene, Scene], clips: tuple[Clip, Clip]) -> tuple[ClipVersion, ClipVersion]:
    """Return both versions of a clip, each on its scene."""
    stacked = [_stack(scene, clip) for scene, clip in zip(scenes, clips, strict=True)]
    moving = {key for side in stacked for batch in side for key in _keys(batch, ~_is_constant(batch))}
    first, second = (_sort_tracks(scene.skeleton, side, moving) for scene, side in zip(scenes, stacked, strict=True))
    return first, second


def _stack(scene: Scene, clip: Clip) -> list[LazyBatch]:
    count = len(scene.skeleton)
    return lazy_batches(track for track in clip.tracks if track.node is not None and track.node < count)


def _sort_tracks(skeleton: Skeleton, of: list[LazyBatch], moving: set[tuple[int, str]]) -> ClipVersion:
    side = ClipVersion(skeleton, [], [])
    for batch in of:
        moves = np.array([(node, batch.path) in moving for node in nodes_of(batch)])
        if moves.any():
            side.moving.extend(_by_block(batch.pick(moves)))
        if not moves.all():
            side.still.append(batch.pick(~moves).first_key())
    return side


def _by_block(batch: LazyBatch) -> Iterable[LazyBatch]:
    """The batch divided by blocks of nodes."""
    blocks = np.array(nodes_of(batch)) // BLOCK_NODES
    return (batch.pick(blocks == block) for block in sorted(set(blocks.tolist())))


def _is_constant(batch: LazyBatch) -> Bools:
    """Mask of a batch's tracks with a single value."""
    if batch.is_long:
        return np.array([_has_one_value(track) for track in batch.tracks])
    same = (batch.whole.values == batch.whole.values[:1]).all(axis=(0, 2))
    if batch.whole.tangents is not None:
        for tangents in batch.whole.tangents:
            same &= (tangents == 0).all(axis=(0, 2))
    return np.asarray(same)


def _has_one_value(track: Track) -> bool:
    is_bent = any(each is not None and each.any() for each in (track.in_tangents, track.out_tangents))
    return not is_bent and bool((track.values == track.values[0]).all())


def _keys(batch: LazyBatch, chosen: Bools) -> Iterable[tuple[int, str]]:
    return ((node, batch.path) for node, is_one in zip(nodes_of(batch), chosen.tolist(), strict=True) if is_one)
