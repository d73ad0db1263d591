"""Optimization of one clip: tracks sorted by treatment, searched, and assembled into a solution."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from anim.arrays import Floats, freeze
from anim.model import FLOAT32, Clip, Interpolation, TimeAxis, Track, parse_weight_pointer
from anim.model.track import share_time_axes
from anim.optimization.options import Drop, Policy
from anim.optimization.search.context import Context
from anim.optimization.search.lockstep import SearchRequest
from anim.optimization.search.plan import FoundKeys, Solution, TrackAction, value_bytes
from anim.optimization.search.source_motion import PATHS, key_grid
from anim.optimization.tracks import clip_ends, key_reduction, morph_weights, quantization
from anim.optimization.tracks.quantization import EncodedKeys
from anim.sampling import times
from anim.sampling.batch import iterate_concatenated
from anim.sampling.weight_pointers import moved_nodes

MORPH_BUDGET_FRACTION = 0.4  # of the bound, for morph weights of a clip that moves joints too
MORPH_ONLY_BUDGET_FRACTION = 0.95  # of the bound, for morph weights of a clip that moves no joint
MAX_LENGTH_ERROR_FRACTION = 0.1  # of the bound; error of the farthest point from non-unit keys


@dataclass(frozen=True, slots=True)
class Task:
    """A clip to optimize.

    shared: per track, constants that other clips use for the same property, the most frequent first.
    unused: (tracks of the clip) whether every clip keeps the property at its rest value. bound: m, for the search.
    at_rest: (tracks of the clip) whether it stays so close to its rest value that no search is needed; empty: unknown.
    extra: points to measure beside the usual ones, (index of the surface, index of the vertex).
    """

    clip: Clip
    shared: tuple[tuple[Floats, ...], ...]
    unused: tuple[bool, ...]
    bound: float
    at_rest: tuple[bool, ...] = ()
    extra: frozenset[tuple[int, int]] = frozenset()

    def is_droppable(self, i: int, policy: Policy) -> bool:
        """Return whether the channel of track `i` may be dropped if the track stays at the rest value."""
        if self.clip.tracks[i].node in policy.keep:
            return False
        return policy.drop is Drop.REST or (policy.drop is Drop.UNUSED and self.unused[i])


Solving: TypeAlias = Generator[SearchRequest, FoundKeys | None, Solution | None]


def solve(context: Context, task: Task) -> Solving:
    """Yield the searches of a clip, of which it takes the results; return the smallest solution within the bounds.

    None if there is none.

    Lines that replace splines are compared track by track, and all of them together: on one time axis each of them can
    be smaller than its spline where all splines would need no such axis.
    """
    found = yield from _TrackSorter(context, task).solution()
    if found is None or _splines(found.clip) == _splines(task.clip):
        return found
    other = yield from _TrackSorter(context, task, keep_splines=True).solution()
    return found if other is None else min(found, other, key=lambda each: each.size(context.coding))


def _splines(clip: Clip) -> int:
    return sum(track.interpolation is Interpolation.CUBICSPLINE and len(track.times) > 1 for track in clip.tracks)


class _TrackSorter:
    """The tracks of one clip, sorted by treatment: dropped, kept, reduced alone or left to the search.

    keep_splines: whether CUBICSPLINE tracks are kept exactly; else those that are smaller than lines.
    """

    def __init__(self, context: Context, task: Task, *, keep_splines: bool = False) -> None:
        self._context = context
        self._task = task
        self._kept = {Interpolation.STEP, Interpolation.CUBICSPLINE} if keep_splines else {Interpolation.STEP}
        self._clip = task.clip
        self._done: dict[int, tuple[Track, EncodedKeys]] = {}
        self._dropped: list[int] = []
        self._free: list[int] = []
        self._spent = 0.0
        self._single_axis: TimeAxis | None = None
        self._off_unit = self._off_unit_tracks()
        for i, track in enumerate(task.clip.tracks):
            self._sort(i, track)
        self._reduce_weights()

    def solution(self) -> Solving:
        found = yield from self._search(self._free)
        splines = [i for i in self._free if self._clip.tracks[i].interpolation is Interpolation.CUBICSPLINE]
        if found is not None:
            splines = [i for i in splines if i in found and self._spline_is_smaller(i, found[i][0], found)]
        if splines:  # smaller than lines, or possibly too curved for lines within the bound
            for i in splines:
                self._keep_exactly(i)
            others = yield from self._search([i for i in self._free if i not in splines])
            found = found if others is None else others
        if found is None:
            return None
        every = {**self._done, **found}
        dropped = [i for i in range(len(self._clip.tracks)) if i not in every]
        return _with_ends(self._clip, every, dropped)

    def _sort(self, i: int, track: Track) -> None:
        policy, exact = self._context.policy, self._context.bounds.max_error == 0
        if _is_weights(track):
            if self._is_invisible(i):
                self._dropped.append(i)
        elif track.node is None:
            self._keep_track(i, key_reduction.reduce_pointer_keys(track, self._context.bounds.max_pointer_error))
        elif self._is_invisible(i):
            self._dropped.append(i)
        elif track.node in policy.keep or exact or track.interpolation in self._kept or i in self._off_unit:
            self._keep_exactly(i)
        elif self._task.at_rest and self._task.at_rest[i]:
            self._settle(i, track)
        else:
            self._free.append(i)

    def _settle(self, i: int, track: Track) -> None:
        """Drop a track at rest, or store its rest value as a single key."""
        if self._is_droppable(i):
            self._dropped.append(i)
            return
        assert track.node is not None
        rest = getattr(self._context.skeleton, track.path)[track.node]
        sign = -1.0 if track.path == "rotation" and track.values[0] @ rest < 0 else 1.0
        axis = self._single_axis or TimeAxis(times.key_times(np.array([self._clip.start])))
        self._single_axis = axis
        stored = quantization.constant_cost(sign * rest)
        self._done[i] = _new_track(track, axis, stored), stored

    def _off_unit_tracks(self) -> frozenset[int]:
        """Tracks whose rotations are so far from unit length that players without normalization differ."""
        rotations = [
            (i, track)
            for i, track in enumerate(self._clip.tracks)
            if track.path == "rotation" and track.interpolation is not Interpolation.CUBICSPLINE
        ]
        found: list[int] = []
        for group in iterate_concatenated([track for _, track in rotations]):
            error = np.maximum.reduceat(np.abs(np.linalg.norm(group.values, axis=1) - 1), group.starts)
            is_off = 2 * error * self._context.size > MAX_LENGTH_ERROR_FRACTION * self._task.bound
            found += group.numbers[is_off].tolist()
        return frozenset(rotations[n][0] for n in found)

    def _is_invisible(self, i: int) -> bool:
        node = self._clip.tracks[i].node
        if node is None:
            return False
        policy = self._context.policy
        return policy.drop_invisible and node not in policy.keep and bool(self._context.invisible[node])

    def _keep_exactly(self, i: int) -> None:
        track = self._clip.tracks[i]
        slim = key_reduction.reduce_lossless(track)
        if len(slim.times) == 1 and self._is_droppable(i) and track.node is not None and track.path in PATHS:
            is_exact = self._context.bounds.max_error == 0  # a rest pose in decimals differs from float32 keys
            precision = np.float64 if is_exact else np.float32
            rest = getattr(self._context.skeleton, track.path)[track.node].astype(precision)
            value = slim.values[0].astype(precision)
            if (value == rest).all() or (track.path == "rotation" and (value == -rest).all()):
                self._dropped.append(i)
                return
        self._keep_track(i, slim)

    def _keep_track(self, i: int, track: Track) -> None:
        self._done[i] = _with_own_keys(track)

    def _is_droppable(self, i: int) -> bool:
        return self._task.is_droppable(i, self._context.policy)

    def _reduce_weights(self) -> None:
        """Reduce morph weights within their own fraction of the bound; the search gets the rest."""
        context = self._context
        weights = [i for i, track in enumerate(self._clip.tracks) if _is_weights(track) and i not in self._dropped]
        # A node's own track, even one that equals the rest pose, replaces those of its mesh: it is not dropped
        has_pointers = any(self._clip.tracks[i].node is None for i in weights)
        fraction = MORPH_BUDGET_FRACTION if self._free else MORPH_ONLY_BUDGET_FRACTION
        bound = fraction * self._task.bound / max(len(weights), 1)
        for i in weights:
            track = self._clip.tracks[i]
            reach = self._weight_reach(track, bound)
            if not reach.size:
                self._keep_track(i, key_reduction.reduce_lossless(track))
                continue
            if track.node is not None and not has_pointers and self._is_droppable(i):
                from_rest = morph_weights.weight_error(track, context.weights_at_rest(track.node), reach)
                if from_rest <= bound:
                    self._dropped.append(i)
                    self._spent += from_rest
                    continue
            new, stored, error = morph_weights.reduce_weights(
                track, reach, bound, key_grid([track]), context.coding.packing
            )
            if track.interpolation is Interpolation.CUBICSPLINE and self._spline_is_smaller(i, new, {i: (new, stored)}):
                self._keep_track(i, key_reduction.reduce_lossless(track))
                continue
            self._done[i] = new, stored
            self._spent += error

    def _weight_reach(self, track: Track, bound: float) -> Floats:
        """The displacement of vertices by weights that may change by at most `bound`, m; empty for an exact track.

        Weights that move no vertex have a vertex each, by which they stay within the bound of tracks without a node.
        """
        context = self._context
        reach, fraction = context.track_reach(track), context.bounds.max_pointer_error
        exact = bound <= 0 or track.interpolation in self._kept or (fraction <= 0 and not reach.any(axis=1).all())
        if exact or not reach.size or context.policy.keep.intersection(moved_nodes(context.skeleton, track)):
            return np.zeros((0, 0))
        return morph_weights.bound_still_weights(track, reach, bound, fraction) if fraction > 0 else reach

    def _spline_is_smaller(self, i: int, lines: Track, found: Mapping[int, tuple[Track, EncodedKeys]]) -> bool:
        """Return whether the source's spline takes fewer bytes than lines, each with its part of a time axis."""
        if len(lines.times) == 1:
            return False
        own = self._bytes(self._clip.tracks[i], self._clip.tracks)
        return own < self._bytes(lines, [track for track, _ in found.values()])

    def _bytes(self, track: Track, all_tracks: Sequence[Track]) -> float:
        sharing = sum(each.time_axis is track.time_axis for each in all_tracks)
        axis = self._context.coding.byte_costs.axis + 4 * len(track.times)
        return value_bytes(track) + axis / sharing

    def _search(
        self, free: Sequence[int]
    ) -> Generator[SearchRequest, FoundKeys | None, dict[int, tuple[Track, EncodedKeys]] | None]:
        """Search the free tracks; None without a solution. Tracks that the search drops are absent."""
        if not free:
            return {}
        found = yield SearchRequest(
            self._clip,
            tuple(free),
            self._task.bound,
            self._spent,
            np.array([self._is_droppable(i) for i in free], np.bool_),
            tuple(self._task.shared[i] for i in free),
            self._task.extra,
        )
        return None if found is None else _tracks(self._clip, found)


def _tracks(clip: Clip, found: FoundKeys) -> dict[int, tuple[Track, EncodedKeys]]:
    axes: dict[bytes, TimeAxis] = {}
    result = {}
    for k, index in enumerate(found.tracks):
        if found.actions[k] == TrackAction.DROPPED:
            continue
        stored = found.keys[k]
        if k in found.on:
            keys = found.on[k]
            at = axes.setdefault(keys.tobytes(), TimeAxis(times.key_times(found.grid[keys])))
        else:
            at = axes.setdefault(b"", TimeAxis(times.key_times(np.array([clip.start]))))
        result[index] = _new_track(clip.tracks[index], at, stored), stored
    return result


def _new_track(track: Track, at: TimeAxis, stored: EncodedKeys) -> Track:
    storage = key_reduction.INT16 if stored.form in ("int16", "quaternion") else FLOAT32
    values = freeze(stored.exact())
    return Track.unchecked(
        track.node, track.path, Interpolation.LINEAR, at, values, pointer=track.pointer, storage=storage
    )


def _with_ends(clip: Clip, every: dict[int, tuple[Track, EncodedKeys]], dropped: list[int]) -> Solution:
    """The solution, with at least one track, and with keys at the clip's start and end."""
    if not every and clip.tracks:
        every = {0: _with_own_keys(clip_ends.single_key(clip.tracks[0]))}
        dropped = [i for i in dropped if i != 0]
    made = Clip(clip.name, tuple(track for track, _ in every.values()))
    if every and (made.end < clip.end or made.start > clip.start):
        number = min(every, key=lambda i: (len(every[i][0].times), every[i][0].values.shape[1], i))
        every[number] = _with_own_keys(clip_ends.extend(every[number][0], clip.start, clip.end))
    ordered = [every[i] for i in sorted(every)]
    tracks, stored = share_time_axes(track for track, _ in ordered), tuple(each for _, each in ordered)
    return Solution(Clip(clip.name, tuple(tracks)), stored, tuple(dropped))


def _is_weights(track: Track) -> bool:
    """Return whether a track animates morph weights, of a node or by a pointer to a mesh's or to a single one."""
    return track.path == "weights" or (track.node is None and parse_weight_pointer(track.pointer) is not None)


def _with_own_keys(track: Track) -> tuple[Track, EncodedKeys]:
    return track, EncodedKeys(track.values, "as it is")
