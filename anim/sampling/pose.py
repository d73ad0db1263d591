"""Clip + Skeleton → Pose at any times."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from functools import cached_property
from typing import TypeAlias

import numpy as np

from anim import arrays
from anim.arrays import Floats, Ints
from anim.errors import NotFoundError
from anim.model import Clip, Pose, Skeleton, TimeAxis, ValueKind
from anim.model.track import NUM_COMPONENTS
from anim.sampling.batch import Batch, ConcatenatedTracks, MixedBatch
from anim.sampling.lazy_batch import mixed_batches
from anim.sampling.track import KeyInterval, find_interval
from anim.sampling.weight_pointers import resolve_weight_pointers
from anim.sampling.world import world_by_node

Tracks: TypeAlias = Batch | MixedBatch | ConcatenatedTracks
Sampler: TypeAlias = Callable[[Tracks, Floats, KeyInterval], Floats]


def sample_pose(skeleton: Skeleton, clip: Clip, at: Floats) -> Pose:
    """Return the local transforms of all nodes at times `at` (F,) s; without a track those at rest.

    Raises NotFoundError for a track of a node that the skeleton lacks, ShapeError or RangeError for bad times.
    """
    return PoseSampler(skeleton, clip).at(at)


def sample_batch(batch: Tracks, at: Floats, place: KeyInterval) -> Floats:
    """Return the values (F, G, C) of a batch at times `at` (F,), as specified by glTF.

    Of concatenated tracks (T, F, C) at times (T, F).
    """
    return batch.sample(at, place)


class PoseSampler:
    """Sampler of a clip on a skeleton for repeated use, with keys stacked on demand.

    sample: gives the values of tracks at times, by default as specified by glTF.
    """

    def __init__(self, skeleton: Skeleton, clip: Clip, sample: Sampler = sample_batch) -> None:
        self._skeleton = skeleton
        self._sample = sample
        nodes = len(skeleton)
        moving = [track for track in resolve_weight_pointers(skeleton, clip).tracks if track.node is not None]
        highest = max((track.node for track in moving if track.node is not None), default=-1)
        if highest >= nodes:
            raise NotFoundError(
                f"there is no node {highest} (the skeleton has {nodes}, from 0 on)",
                where=f"clip '{clip.name}'" if clip.name else "",
            )
        self._stacks, self._mixed = mixed_batches(moving)
        self._time_axes = tuple(dict.fromkeys(track.time_axis for track in moving))

    def sampled(self, sample: Sampler) -> PoseSampler:
        """Return the sampler of the same clip and skeleton with another sampling function for tracks."""
        other = copy(self)
        other._sample = sample
        return other

    def at(self, at: Floats) -> Pose:
        """Return the local transforms of all nodes at times `at` (F,) in seconds."""
        return self.at_each(at, (self._sample,))

    def at_each(self, at: Floats, samples: Sequence[Sampler]) -> Pose:
        """Return the poses at times `at` (F,) by S sampling functions, which differ in rotations only: S · F frames."""
        at = arrays.as_floats(at, "F", name="times")
        frames = len(at) * len(samples)
        parts = {path: _rest_values(getattr(self._skeleton, path), frames) for path in NUM_COMPONENTS}
        weights: dict[int, Floats] = {}
        places = {axis: find_interval(axis.times, at) for axis in self._time_axes}
        for batch, place in self._located(places):
            used = samples if batch.kind is ValueKind.ROTATION else samples[:1]
            values = np.concatenate([sample(batch, at, place) for sample in used])
            numbers = [track.node for track in batch.tracks if track.node is not None]
            if batch.path == "weights":
                weights.update((node, _repeated(values[:, i], frames)) for i, node in enumerate(numbers))
                continue
            for first in range(0, frames, max(len(values), 1)):
                parts[batch.path][first : first + len(values), numbers] = values
        times = at if len(samples) == 1 else _repeated(at, frames)
        return Pose(times, parts["translation"], parts["rotation"], parts["scale"], weights)

    def _located(self, places: Mapping[TimeAxis, KeyInterval]) -> Iterator[tuple[Batch | MixedBatch, KeyInterval]]:
        """Yield every batch with the key intervals of its tracks."""
        for stack in self._stacks:
            place = places[stack.time_axis]
            batch, left, right = stack.at(place.left, place.right)
            yield batch, place._replace(left=left, right=right)
        for mixed in self._mixed:
            yield mixed, mixed.find_intervals(places)

    def posed(self, at: Floats) -> PosedSkeleton:
        """Return the skeleton at times `at` (F,) in seconds."""
        return PosedSkeleton(self._skeleton, self.at(at))


class PosedSkeleton:
    """A skeleton at F times: its pose, and world matrices, computed on demand."""

    def __init__(self, skeleton: Skeleton, pose: Pose) -> None:
        self.skeleton, self.pose = skeleton, pose

    @classmethod
    def at_rest(cls, skeleton: Skeleton) -> PosedSkeleton:
        """Return a skeleton in its rest pose, as one frame at 0 s."""
        return cls(skeleton, rest_pose(skeleton))

    @property
    def times(self) -> Floats:
        """Times (F,) in seconds."""
        return self.pose.times

    @property
    def weights(self) -> Mapping[int, Floats]:
        """Animated morph weights (F, M) by node."""
        return self.pose.weights

    @cached_property
    def world(self) -> Floats:
        """World matrices (N, F, 3, 4)."""
        return world_by_node(self.skeleton, self.pose)

    def take(self, frames: Ints) -> PosedSkeleton:
        """Return the skeleton at some of the times, by index, without sampling again."""
        pose = self.pose
        weights = {node: each[frames] for node, each in pose.weights.items()}
        parts = pose.translation[frames], pose.rotation[frames], pose.scale[frames]
        taken = PosedSkeleton(self.skeleton, Pose(pose.times[frames], *parts, weights))
        columns = np.take(np.swapaxes(self.world, 1, 3), frames, axis=-1)  # contiguous over frames, as computed
        taken.world = np.swapaxes(columns, 1, 3)
        return taken

    def of(self, nodes: Ints) -> Floats:
        """Return the world matrices (J, F, 3, 4) of some nodes; −1 is the world itself."""
        found: Floats = self.world[nodes]
        found[nodes < 0] = np.eye(4)[:3]
        return found


def rest_pose(skeleton: Skeleton) -> Pose:
    """Return the rest pose, as one frame at 0 s."""
    return sample_pose(skeleton, Clip("", ()), np.zeros(1))


def rest_world(skeleton: Skeleton) -> Floats:
    """Return world_from_node (N, 3, 4) of every node in the rest pose, read-only: computed once for each skeleton."""
    return skeleton.derive(_compute_rest_world)


def _compute_rest_world(skeleton: Skeleton) -> Floats:
    return PosedSkeleton.at_rest(skeleton).world[:, 0]


def _repeated(values: Floats, frames: int) -> Floats:
    """Values (F, ...) repeated as a whole, up to a number of frames."""
    return values if len(values) == frames else np.concatenate([values] * (frames // len(values)))


def _rest_values(values: Floats, frames: int) -> Floats:
    """Values (F, N, C), in memory node by node, the order of matrices."""
    return np.swapaxes(np.repeat(values[:, None], frames, axis=1), 0, 1)
