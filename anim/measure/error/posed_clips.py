"""Clips posed at times of each, by several players, as one pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from anim.arrays import Floats, Ints, unique_sorted
from anim.model import Clip, Pose, Skeleton
from anim.sampling.players import sampler
from anim.sampling.pose import PosedSkeleton, PoseSampler

Samplers: TypeAlias = tuple[PoseSampler, PoseSampler]  # before and after
MAX_RECENT_KEYS = 40_000  # of tracks, of clips that are measured together; stacked they take 2 MB


class AskedTimes(NamedTuple):
    """Times of clips to pose by one player, a name in PLAYERS. times: (F,) s. clip: (F,) index of each one's clip."""

    player: str
    times: Floats
    clip: Ints


class _Entry(NamedTuple):
    before: Clip
    after: Clip
    num_keys: int
    samplers: Samplers


class RecentSamplers:
    """Samplers of both versions of the clips that were posed last."""

    def __init__(self) -> None:
        self._entries: list[_Entry] = []

    def find(self, before: Clip, after: Clip) -> Samplers | None:
        """Return the samplers of a clip, None if it is not among the last."""
        found = (each.samplers for each in self._entries if each.before is before and each.after is after)
        return next(found, None)

    def add(self, before: Clip, after: Clip, samplers: Samplers) -> Samplers:
        """Add the samplers of a clip, which are returned, in place of the oldest ones if there are too many keys."""
        num_keys = sum(len(track.times) for clip in (before, after) for track in clip.tracks)
        while self._entries and num_keys + sum(each.num_keys for each in self._entries) > MAX_RECENT_KEYS:
            del self._entries[0]
        self._entries.append(_Entry(before, after, num_keys, samplers))
        return samplers


def has_weights(*clips: Clip) -> bool:
    """Return whether any track can move morph weights: such clips are posed by themselves."""
    return any(track.path == "weights" or track.node is None for clip in clips for track in clip.tracks)


def pose_clips(skeleton: Skeleton, poses: Mapping[int, PoseSampler], asked: Sequence[AskedTimes]) -> PosedSkeleton:
    """Return a skeleton at the times that are asked for of each player, one after the other.

    poses: samplers of clips by index; several have no morph weights.
    """
    clip = np.concatenate([each.clip for each in asked])
    found: list[Pose] = []
    frames, first = np.empty(len(clip), np.int64), 0
    for n, each in poses.items():
        own = [(one.player, one.times[one.clip == n]) for one in asked]
        pose, taken = _posed(each, [(player, times) for player, times in own if len(times)])
        frames[clip == n] = first + taken
        first += len(pose.times)
        found.append(pose)
    is_all = first == len(frames) and np.array_equal(frames, np.arange(first))
    return PosedSkeleton(skeleton, found[0] if is_all and len(found) == 1 else _taken(found, frames))


def _posed(poses: PoseSampler, asked: Sequence[tuple[str, Floats]]) -> tuple[Pose, Ints]:
    """The clip at all of the times by every player, and the frames that are asked for: mostly nearly all."""
    at = unique_sorted(np.concatenate([times for _, times in asked]))
    pose = poses.at_each(at, [sampler(player) for player, _ in asked])
    return pose, np.concatenate([i * len(at) + np.searchsorted(at, times) for i, (_, times) in enumerate(asked)])


def _taken(poses: Sequence[Pose], frames: Ints) -> Pose:
    """Some of the frames of all poses, node by node in memory."""
    translation, rotation, scale = (
        np.swapaxes(np.concatenate([np.swapaxes(getattr(each, part), 0, 1) for each in poses], axis=1)[:, frames], 0, 1)
        for part in ("translation", "rotation", "scale")
    )
    weights = {node: each[frames] for node, each in poses[0].weights.items()} if len(poses) == 1 else {}
    return Pose(np.concatenate([each.times for each in poses])[frames], translation, rotation, scale, weights)
