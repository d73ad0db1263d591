"""Trials of several clips at once: from decisions to keys, played motion, errors and bytes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple, TypeAlias

import numpy as np

from anim.arrays import Floats, Ints
from anim.model import Skeleton
from anim.optimization.search import playback
from anim.optimization.search.axis_merging import SharedAxis
from anim.optimization.search.bound_usage import BoundUsage
from anim.optimization.search.keyed_tracks import KeyedAxes, KeyedTracks, StoredTracks
from anim.optimization.search.parent_compensation import ParentCompensation, budget_gain
from anim.optimization.search.plan import RotationTarget, TrackAction, TrialResult
from anim.optimization.search.source_motion import PATHS, ROTATION
from anim.optimization.search.stacked_clips import StackedClips
from anim.optimization.search.time_axes import Asked, find_axes
from anim.optimization.search.trial import ClipTrials, Decisions, Trial
from anim.optimization.tracks import quantization
from anim.optimization.tracks.quantization import EncodedKeys, Encoding

CHORD_BOUND_FRACTION = 0.02  # of the bound; if slerp and nlerp are closer, only slerp is measured

NO_VALUES = np.empty((0, 0, 0))  # values that were written: they are large for long clips

TrialRequest: TypeAlias = tuple[int, Trial]  # index of the clip, and what to try in it


class _Played(NamedTuple):
    """Decided trials of b clips, and what players show of them.

    clips: (b,), increasing. slot: (B,) index of each clip among them. shown: translation (3, M, b, W), rotation
    (4, M, b, W), scale (3, M, b, W) of nodes with tracks. keys: of each clip, by track.
    """

    clips: Ints
    slot: Ints
    decisions: list[Decisions]
    shown: list[Floats]
    keys: list[dict[int, EncodedKeys]]

    def take_shown(self, some: Sequence[int]) -> list[Floats]:
        """Return what is shown of some of the clips, by slot."""
        if len(some) == len(self.clips):
            return self.shown
        return [np.take(part, some, axis=2) for part in self.shown]


class TrialBatch:
    """Runs trials of some clips, at most one of each clip at a time."""

    def __init__(
        self,
        skeleton: Skeleton,
        clips: StackedClips,
        trials: Sequence[ClipTrials],
        usage: BoundUsage,
        coding: Encoding,
    ) -> None:
        self._skeleton = skeleton
        self._clips = clips
        self._trials = trials
        self._usage = usage
        self._keyed = KeyedTracks(clips, coding.packing)
        self._leeway: dict[int, Floats] = {}
        self._meters = np.concatenate([each.meters for each in trials])
        self._chord_limits = CHORD_BOUND_FRACTION * np.array([each.bound for each in trials])[clips.clip]  # (T,)

    def leeway(self, clip: int) -> Floats:
        """Return the ratio of each track's moment arm to the compensated one (G,), in one clip."""
        if clip not in self._leeway:
            self._leeway[clip] = budget_gain(self._skeleton, self._clips.sources[clip], self._clips.points)
        return self._leeway[clip]

    def run(self, requests: Sequence[TrialRequest]) -> list[TrialResult | None]:
        """Return the result of each trial; None for one that takes `limit` or more bytes.

        requests: in the order of their clips.
        """
        actions = [self._trials[clip].actions(trial.plan) for clip, trial in requests]
        axes = self._find_axes(requests, actions)
        found: dict[int, TrialResult | None] = {}
        decided: dict[RotationTarget, dict[int, Decisions]] = {target: {} for target in RotationTarget}
        for (clip, trial), some, listed in zip(requests, actions, axes, strict=True):
            decisions = self._trials[clip].decide(trial, some, listed)
            if isinstance(decisions, Decisions):
                decided[trial.plan.rotation_target][clip] = decisions
            else:
                found[clip] = decisions
        for target, group in decided.items():
            if group:
                found.update(self._run_decided(group, target))
        return [found[clip] for clip, _ in requests]

    def _find_axes(self, requests: Sequence[TrialRequest], actions: Sequence[Ints]) -> list[list[SharedAxis]]:
        """The time axes of each trial; those of one layout are found together."""
        found: list[list[SharedAxis]] = [[] for _ in requests]
        for name in dict.fromkeys(trial.plan.axes for _, trial in requests):
            places = [n for n, (_, trial) in enumerate(requests) if trial.plan.axes == name]
            asked = []
            for n in places:
                clip, trial = requests[n]
                keyed = np.flatnonzero(actions[n] == TrackAction.KEYED)
                asked.append(Asked(self._trials[clip].layouts, keyed, trial.plan.budgets, trial.plan.groups))
            for n, axes in zip(places, find_axes(name, asked), strict=True):
                found[n] = axes
        return found

    def _run_decided(
        self, group: dict[int, Decisions], target: RotationTarget
    ) -> Iterator[tuple[int, TrialResult | None]]:
        """The results of trials with one target, by clip."""
        played = self._prepare(group)
        axes = self._keyed.on([(clip, each.axes) for clip, each in group.items()])
        made = list(self._store(played, axes, target))
        self._add_keys(played, made)
        sizes = {
            clip: self._trials[clip].sizes.size(each.actions, mine, each.axes)
            for (clip, each), mine in zip(group.items(), played.keys, strict=True)
        }
        measured = [slot for slot, (clip, each) in enumerate(group.items()) if sizes[clip] < each.trial.limit]
        results = self._measure(played, measured, sizes)
        bent = self._bent_clips(made, axes)
        chords = [
            slot
            for slot, (clip, each) in enumerate(group.items())
            if clip in bent and clip in results and results[clip].worst <= 1 and sizes[clip] < each.trial.smaller_than
        ]
        if chords:
            self._write_chords(played, made, axes)
            usage = self._usage.nlerp(played.take_shown(chords), played.clips[chords])
            for clip, more in zip(played.clips[chords].tolist(), usage.T, strict=True):
                results[clip] = replace(results[clip], usage=np.maximum(results[clip].usage, more))
        yield from ((clip, results.get(clip)) for clip in group)

    def _prepare(self, group: dict[int, Decisions]) -> _Played:
        """The clips as in the source, but for constant and dropped tracks."""
        clips = np.array(list(group), np.int64)
        slot = np.zeros(len(self._clips.sources), np.int64)
        slot[clips] = np.arange(len(clips))
        shown = [np.take(part, clips, axis=2) for part in self._clips.local]
        keys = [
            self._single_keys(clip, each, [part[:, :, n] for part in shown])
            for n, (clip, each) in enumerate(group.items())
        ]
        return _Played(clips, slot, list(group.values()), shown, keys)

    def _single_keys(self, clip: int, decisions: Decisions, shown: Sequence[Floats]) -> dict[int, EncodedKeys]:
        """Single keys of constant tracks; writes them and the rest values of dropped tracks to `shown` (C, M, W)."""
        moving, first = self._clips.sources[clip].moving, self._clips.first_track[clip]
        keys = {i: quantization.constant_cost(value) for i, value in decisions.constants.items()}
        still = {i: moving[i].rest for i in np.flatnonzero(decisions.actions == TrackAction.DROPPED).tolist()}
        still.update((i, each.values[0]) for i, each in keys.items())
        for i, value in still.items():
            shown[self._clips.path[first + i]][:, self._clips.row[first + i]] = value[:, None]
        return keys

    def _store(self, played: _Played, axes: KeyedAxes, target: RotationTarget) -> Iterator[StoredTracks]:
        """All keyed tracks of the clips; writes their played values to what is shown."""
        tolerances = np.zeros(len(self._clips.clip))
        first = self._clips.first_track
        for clip, each in zip(played.clips.tolist(), played.decisions, strict=True):
            tolerances[first[clip] : first[clip + 1]] = each.tolerances
        paths = list(range(len(PATHS)))
        if target is RotationTarget.WORLD:
            paths.remove(ROTATION)
            for made in self._compensation.follow(axes, tolerances, played.shown[ROTATION], played.clips):
                yield made._replace(shown=NO_VALUES)
        for path in paths:
            for made in self._keyed.each(path, axes, tolerances):
                self._write(played, path, made.tracks, made.shown)
                yield made._replace(shown=NO_VALUES)

    def _write(self, played: _Played, path: int, tracks: Ints, values: Floats) -> None:
        """Write the values (C, T, W) of tracks of one path to what is shown."""
        played.shown[path][:, self._clips.row[tracks], played.slot[self._clips.clip[tracks]]] = values

    def _add_keys(self, played: _Played, made: Sequence[StoredTracks]) -> None:
        """Add the stored keys of all tracks to those of their clips."""
        for each in made:
            clips = self._clips.clip[each.tracks]
            slots, own = played.slot[clips].tolist(), (each.tracks - self._clips.first_track[clips]).tolist()
            for slot, track, stored in zip(slots, own, each.stored, strict=True):
                played.keys[slot][track] = stored

    def _measure(self, played: _Played, measured: Sequence[int], sizes: dict[int, float]) -> dict[int, TrialResult]:
        """The results of some of the clips, by slot, as measured with slerp."""
        results: dict[int, TrialResult] = {}
        if not measured:
            return results
        shown, clips = played.take_shown(measured), played.clips[measured]
        usages = zip(self._usage.slerp_raw(shown, clips).T, self._usage.own(shown, clips), strict=True)
        for clip, slot, (usage, own) in zip(clips.tolist(), measured, usages, strict=True):
            each = played.decisions[slot]
            on = {i: axis.keys for axis in each.axes for i in axis.members}
            results[clip] = result = TrialResult(
                each.trial.plan, each.actions, played.keys[slot], on, np.ascontiguousarray(usage), own, sizes[clip]
            )
            self._trials[clip].results.add(each.name, result)
        return results

    def _bent_clips(self, made: Sequence[StoredTracks], axes: KeyedAxes) -> set[int]:
        """The clips where slerp and nlerp differ noticeably, in the result or in the source."""
        bent = set(self._clips.bent)
        for each in (some for some in made if len(some.keys) == 4):
            counts = axes.intervals.counts[axes.axis_of[each.tracks]]
            turned = playback.steps(np.transpose(each.keys, (2, 1, 0)))  # (K - 1, T)
            turned[np.arange(1, each.keys.shape[2])[:, None] >= counts] = 0.0
            gap = playback.arc_distance(turned.max(axis=0, initial=0.0)) / 2 * self._meters[each.tracks]
            bent.update(self._clips.clip[each.tracks[gap > self._chord_limits[each.tracks]]].tolist())
        return bent

    def _write_chords(self, played: _Played, made: Sequence[StoredTracks], axes: KeyedAxes) -> None:
        """Write the values of rotations in players with component-wise interpolation to what is shown."""
        for each in (some for some in made if len(some.keys) == 4):
            axis_of = axes.axis_of[each.tracks]
            mixed = playback.nlerp(each.keys, axes.intervals.left[axis_of], axes.intervals.u[axis_of])
            self._write(played, ROTATION, each.tracks, mixed)

    @cached_property
    def _compensation(self) -> ParentCompensation:
        return ParentCompensation(self._skeleton, self._clips, self._keyed)
