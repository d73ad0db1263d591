"""The two versions of a clip, their tracks sorted by what moves."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.model import Clip, Scene, Skeleton, TimeAxis
from anim.sampling.batch import Batch, batches

BLOCK_NODES = 2048  # of moving nodes bounded at a time


class ClipVersion(NamedTuple):
    """One version: nodes at rest, tracks of nodes that move in either, constant tracks with one key each.

    All stacked, moving ones by blocks of nodes too, for memory.
    """

    skeleton: Skeleton
    moving: list[Batch]
    still: list[Batch]

    def nodes(self, path: str) -> set[int]:
        """Return the nodes with moving tracks of a path."""
        return {node for batch in self.moving if batch.path == path for node in nodes_of(batch)}

    def moving_blocks(self, path: str) -> dict[int, list[Batch]]:
        """Return the moving tracks of a path by block of nodes."""
        found: dict[int, list[Batch]] = {}
        for batch in self.moving:
            if batch.path == path:
                found.setdefault(nodes_of(batch)[0] // BLOCK_NODES, []).append(batch)
        return found

    def constant_values(self, path: str) -> Floats:
        """Return the constant values (N, C) of static nodes: of their tracks, or of the rest pose."""
        values: Floats = getattr(self.skeleton, path).copy()
        for batch in self.still:
            if batch.path == path:
                values[nodes_of(batch)] = batch.values[0]
        return values

    def still_tracks(self, path: str, nodes: Ints) -> list[Batch]:
        """Return the constant tracks of some nodes (U,)."""
        wanted = set(nodes.tolist())
        chosen = [(b, np.array([n in wanted for n in nodes_of(b)])) for b in self.still if b.path == path]
        return [_pick_tracks(batch, some) for batch, some in chosen if some.any()]

    def weights(self, node: int, count: int) -> list[Batch]:
        """Return the track of a node's `count` morph weights, if it has one."""
        all_ = (track for batch in (*self.moving, *self.still) for track in batch.tracks if batch.path == "weights")
        return batches(track for track in all_ if track.node == node and track.values.shape[1] == count)


def nodes_of(batch: Batch) -> list[int]:
    """Return the nodes of a batch's tracks."""
    return [track.node for track in batch.tracks if track.node is not None]


def partition_tracks(scenes: tuple[Scene, Scene], clips: tuple[Clip, Clip]) -> tuple[ClipVersion, ClipVersion]:
    """Return both versions of a clip, each on its scene."""
    stacked = [_stack(scene, clip) for scene, clip in zip(scenes, clips, strict=True)]
    moving = {key for side in stacked for batch in side for key in _keys(batch, ~_is_constant(batch))}
    first, second = (_sort_tracks(scene.skeleton, side, moving) for scene, side in zip(scenes, stacked, strict=True))
    return first, second


def _stack(scene: Scene, clip: Clip) -> list[Batch]:
    count = len(scene.skeleton)
    return batches(track for track in clip.tracks if track.node is not None and track.node < count)


def _sort_tracks(skeleton: Skeleton, of: list[Batch], moving: set[tuple[int, str]]) -> ClipVersion:
    side = ClipVersion(skeleton, [], [])
    for batch in of:
        moves = np.array([(node, batch.path) in moving for node in nodes_of(batch)])
        if moves.any():
            side.moving.extend(_by_block(_pick_tracks(batch, moves)))
        if not moves.all():
            rest = _pick_tracks(batch, ~moves)
            tangents = None if rest.tangents is None else (rest.tangents[0][:1], rest.tangents[1][:1])
            side.still.append(
                replace(rest, time_axis=TimeAxis(rest.times[:1]), values=rest.values[:1], tangents=tangents)
            )
    return side


def _by_block(batch: Batch) -> Iterable[Batch]:
    """The batch divided by blocks of nodes."""
    blocks = np.array(nodes_of(batch)) // BLOCK_NODES
    return (_pick_tracks(batch, blocks == block) for block in sorted(set(blocks.tolist())))


def _is_constant(batch: Batch) -> Bools:
    """Mask of a batch's tracks with a single value."""
    same = (batch.values == batch.values[:1]).all(axis=(0, 2))
    if batch.tangents is not None:
        for tangents in batch.tangents:
            same &= (tangents == 0).all(axis=(0, 2))
    return np.asarray(same)


def _keys(batch: Batch, chosen: Bools) -> Iterable[tuple[int, str]]:
    return ((node, batch.path) for node, is_one in zip(nodes_of(batch), chosen.tolist(), strict=True) if is_one)


def _pick_tracks(batch: Batch, chosen: Bools) -> Batch:
    """The chosen (G,) of a batch's tracks as a batch."""
    if chosen.all():
        return batch
    tracks = tuple(track for track, is_one in zip(batch.tracks, chosen.tolist(), strict=True) if is_one)
    tangents = None if batch.tangents is None else (batch.tangents[0][:, chosen], batch.tangents[1][:, chosen])
    return Batch(tracks, batch.numbers[chosen], batch.time_axis, batch.values[:, chosen], tangents)
