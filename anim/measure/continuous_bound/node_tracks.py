"""Nodes in the intervals of several clips, with their tracks: bounds of all are computed together."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import AnyArray, Floats, Ints
from anim.measure.continuous_bound.intervals import Intervals
from anim.measure.continuous_bound.track_partition import ClipVersion, nodes_of
from anim.sampling.lazy_batch import LazyBatch

MAX_PAIRS = 2048  # of nodes and intervals at a time: arrays of four players fit into the processor's cache


class ClipSpan(NamedTuple):
    """Successive intervals of one clip, and both versions of it."""

    versions: tuple[ClipVersion, ClipVersion]
    where: Intervals


class NodeTracks(NamedTuple):
    """One version of U nodes in G intervals of a clip: U · G pairs, those of one node after those of another.

    nodes: (U,), increasing. rest: (U, C), values without a track. tracks: of these nodes, of one path.
    """

    nodes: Ints
    rest: Floats
    tracks: Sequence[LazyBatch]
    where: Intervals

    @property
    def num_pairs(self) -> int:
        """Number of pairs of a node and an interval."""
        return len(self.nodes) * len(self.where)

    def rows(self, batch: LazyBatch) -> Ints:
        """Return the indices among `nodes` of the nodes of a batch."""
        return np.searchsorted(self.nodes, nodes_of(batch))

    def view(self, pairs: AnyArray) -> AnyArray:
        """Return an array (..., U · G) as (..., U, G), in the same memory."""
        return pairs.reshape(*pairs.shape[:-1], len(self.nodes), len(self.where))


class NodeIntervals(NamedTuple):
    """Both versions of some nodes in the intervals of a clip.

    columns: the intervals among those of all spans; of static nodes `where` is one that stands for all.
    """

    nodes: Ints
    tracks: tuple[Sequence[LazyBatch], Sequence[LazyBatch]]
    where: Intervals
    columns: slice

    @property
    def num_pairs(self) -> int:
        """Number of pairs of a node and an interval."""
        return len(self.nodes) * len(self.where)

    def version(self, k: int, rest: Floats) -> NodeTracks:
        """Return one version. rest: (N, C), values of all nodes without a track."""
        return NodeTracks(self.nodes, rest[self.nodes], self.tracks[k], self.where)


def moving_nodes(of: ClipSpan, path: str, columns: slice) -> Iterator[NodeIntervals]:
    """Yield the nodes that move in either version, by blocks, with all intervals."""
    first, second = (version.moving_blocks(path) for version in of.versions)
    for block in sorted({*first, *second}):
        tracks = first.get(block, []), second.get(block, [])
        nodes = np.array(sorted({node for side in tracks for batch in side for node in nodes_of(batch)}), np.int64)
        yield NodeIntervals(nodes, tracks, of.where, columns)


def late_nodes(of: ClipSpan) -> set[int]:
    """Return the nodes with a constant rotation after the first interval: some players normalize only from then on."""
    late = (
        batch
        for version in of.versions
        for batch in version.still
        if batch.path == "rotation" and batch.time_axis.times[-1] > of.where.edges[1]
    )
    return {node for batch in late for node in nodes_of(batch)}


def static_nodes(of: ClipSpan, columns: slice, uneven: Collection[int]) -> NodeIntervals:
    """Return the nodes of `uneven` whose rotations are constant in both versions, with one interval: all are equal."""
    moving = {node for version in of.versions for node in version.nodes("rotation")}
    nodes = np.array(sorted(set(uneven) - moving), np.int64)
    first, second = (version.still_tracks("rotation", nodes) for version in of.versions)
    return NodeIntervals(nodes, (first, second), of.where.first, columns)


def columns_of(spans: Sequence[ClipSpan]) -> list[slice]:
    """Return each one's intervals among those of all."""
    return _slices([len(each.where) for each in spans])


def pairs_of(tracks: Sequence[NodeTracks]) -> Iterator[tuple[NodeTracks, slice]]:
    """Yield all with their pairs among those of all."""
    return zip(tracks, _slices([each.num_pairs for each in tracks]), strict=True)


def pair_lengths(of: Sequence[NodeIntervals]) -> Floats:
    """Return the lengths (L,) in s of the intervals of all pairs."""
    return np.concatenate([np.tile(each.where.lengths, len(each.nodes)) for each in of])


def write_pairs(found: Floats, of: Sequence[NodeIntervals], into: Floats) -> None:
    """Write what was found (..., L) of all pairs into an array (..., N, G) of all nodes and intervals."""
    for each, pairs in zip(of, _slices([each.num_pairs for each in of]), strict=True):
        part = found[..., pairs]
        into[..., each.nodes, each.columns] = part.reshape(*part.shape[:-1], len(each.nodes), len(each.where))


def pack(parts: Iterable[NodeIntervals]) -> Iterator[list[NodeIntervals]]:
    """Yield the parts in groups of up to MAX_PAIRS pairs; a larger one is a group of its own."""
    group: list[NodeIntervals] = []
    room = MAX_PAIRS
    for part in parts:
        if part.num_pairs > room and group:
            yield group
            group, room = [], MAX_PAIRS
        if part.num_pairs:
            group.append(part)
            room -= part.num_pairs
    if group:
        yield group


def _slices(counts: Sequence[int]) -> list[slice]:
    ends = np.cumsum(counts).tolist()
    return [slice(end - count, end) for end, count in zip(ends, counts, strict=True)]
