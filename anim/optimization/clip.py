"""One clip, optimized: every track sorted by what can be done with it, searched, and put together again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from anim.arrays import Floats
from anim.model import FLOAT32, Clip, Interpolation, Track
from anim.optimization.options import Drop
from anim.optimization.search.bound_usage import BoundUsage
from anim.optimization.search.context import Context
from anim.optimization.search.plan import TrackAction, TrialResult
from anim.optimization.search.search import search
from anim.optimization.search.solution import Solution, value_bytes
from anim.optimization.search.source_motion import PATHS, SourceMotion, analyze_source, key_grid
from anim.optimization.search.trial import CHORDS_NOTICED, TrialRunner
from anim.optimization.tracks import clip_ends, lossless, morph_weights, pointer_tracks
from anim.optimization.tracks.quantization import EncodedKeys
from anim.sampling import times

MORPH_BUDGET_FRACTION = 0.4  # of the bound that morph weights may use where joints move too
MORPH_ALONE = 0.95
NOT_UNIT = 0.1  # of the bound, that a rotation's length may move the farthest point in players that don't normalize


@dataclass(frozen=True, slots=True)
class Task:
    """A clip to optimize. shared: per track, values that other clips hold it at, the best first.

    unused: (tracks of the clip) whether no clip moves the property away from rest. bound: m, what the search may use.
    """

    clip: Clip
    shared: tuple[tuple[Floats, ...], ...]
    unused: tuple[bool, ...]
    bound: float


def solve(setting: Context, task: Task) -> Solution | None:
    """Return the clip in as few bytes as the effort finds; None where no way keeps the bounds."""
    return _SortedTracks(setting, task).solution()


class _SortedTracks:
    """The tracks of one clip, by what can be done with them."""

    def __init__(self, setting: Context, task: Task) -> None:
        self._setting = setting
        self._task = task
        self._clip = task.clip
        self._done: dict[int, tuple[Track, EncodedKeys]] = {}
        self._dropped: list[int] = []
        self._free: list[int] = []
        self._spent = 0.0
        for i, track in enumerate(task.clip.tracks):
            self._sort(i, track)
        self._thin_weights()

    def solution(self) -> Solution | None:
        found = self._searched(self._free)
        splines = [i for i in self._free if self._clip.tracks[i].interpolation is Interpolation.CUBICSPLINE]
        if found is not None:
            splines = [i for i in splines if i in found and self._spline_is_smaller(i, found[i][0], found)]
        if splines:  # smaller than lines, or maybe too bent for any
            for i in splines:
                self._keep_exactly(i)
            others = self._searched([i for i in self._free if i not in splines])
            found = found if others is None else others
        if found is None:
            return None
        every = {**self._done, **found}
        dropped = [i for i in range(len(self._clip.tracks)) if i not in every]
        return _with_ends(self._clip, every, dropped)

    def _sort(self, i: int, track: Track) -> None:
        policy, exact = self._setting.policy, self._setting.bounds.max_error == 0
        if track.node is None or track.path == "pointer":
            self._put(i, pointer_tracks.reduce_pointer_keys(track, self._setting.bounds.max_pointer_error))
        elif self._is_unseen(i):
            self._dropped.append(i)
        elif track.path == "weights":
            pass
        elif track.node in policy.keep or exact or track.interpolation is Interpolation.STEP or self._is_bent(track):
            self._keep_exactly(i)
        else:
            self._free.append(i)

    def _is_bent(self, track: Track) -> bool:
        """Whether rotations are so far from unit length that players which don't normalize them show something else."""
        if track.path != "rotation" or track.interpolation is Interpolation.CUBICSPLINE:
            return False
        off = np.abs(np.linalg.norm(track.values, axis=1) - 1).max()
        return bool(2 * off * self._setting.size > NOT_UNIT * self._task.bound)

    def _is_unseen(self, i: int) -> bool:
        node = self._clip.tracks[i].node
        policy = self._setting.policy
        return policy.drop_invisible and node not in policy.keep and bool(self._setting.unseen[node])

    def _keep_exactly(self, i: int) -> None:
        track = self._clip.tracks[i]
        slim = lossless.reduce_lossless(track)
        if len(slim.times) == 1 and self._droppable(i) and track.node is not None and track.path in PATHS:
            is_exact = self._setting.bounds.max_error == 0  # a rest pose in decimals differs from float32 keys
            precision = np.float64 if is_exact else np.float32
            rest = getattr(self._setting.skeleton, track.path)[track.node].astype(precision)
            value = slim.values[0].astype(precision)
            if (value == rest).all() or (track.path == "rotation" and (value == -rest).all()):
                self._dropped.append(i)
                return
        self._put(i, slim)

    def _put(self, i: int, track: Track) -> None:
        self._done[i] = _unchanged(track)

    def _droppable(self, i: int) -> bool:
        policy = self._setting.policy
        if self._clip.tracks[i].node in policy.keep:
            return False
        return policy.drop is Drop.REST or (policy.drop is Drop.UNUSED and self._task.unused[i])

    def _thin_weights(self) -> None:
        """Morph weights have a share of the bound of their own; what they use of it the search may not."""
        setting = self._setting
        weights = [i for i, track in enumerate(self._clip.tracks) if track.path == "weights" and i not in self._done]
        share = MORPH_BUDGET_FRACTION if self._free else MORPH_ALONE
        bound = share * self._task.bound / max(len(weights), 1)
        for i in weights:
            track = self._clip.tracks[i]
            assert track.node is not None
            reach = setting.morph_reach(track.node)
            exact = setting.bounds.max_error == 0 or track.node in setting.policy.keep
            if exact or not reach.size or track.interpolation is Interpolation.STEP:
                self._put(i, lossless.reduce_lossless(track))
                continue
            from_rest = morph_weights.weight_error(track, setting.weights_at_rest(track.node), reach)
            if self._droppable(i) and from_rest <= bound:
                self._dropped.append(i)
                self._spent += from_rest
                continue
            new, stored, off = morph_weights.reduce_weights(
                track, reach, bound, key_grid([track]), setting.coding.packing
            )
            if track.interpolation is Interpolation.CUBICSPLINE and self._spline_is_smaller(i, new, {i: (new, stored)}):
                self._put(i, lossless.reduce_lossless(track))
                continue
            self._done[i] = new, stored
            self._spent += off

    def _spline_is_smaller(self, i: int, lines: Track, found: Mapping[int, tuple[Track, EncodedKeys]]) -> bool:
        """Whether the source's own spline takes fewer bytes than lines do, each with its part of a time axis."""
        if len(lines.times) == 1:
            return False
        own = self._bytes(self._clip.tracks[i], self._clip.tracks)
        return own < self._bytes(lines, [track for track, _ in found.values()])

    def _bytes(self, track: Track, all_tracks: Sequence[Track]) -> float:
        sharing = sum(each.times is track.times for each in all_tracks)
        axis = self._setting.coding.prices.axis + 4 * len(track.times)
        return value_bytes(track) + axis / sharing

    def _searched(self, free: Sequence[int]) -> dict[int, tuple[Track, EncodedKeys]] | None:
        """The free tracks as the search left them, without those that it dropped; None where it found no way."""
        setting = self._setting
        if not free:
            return {}
        bound = self._task.bound
        found = analyze_source(
            setting.skeleton,
            self._clip,
            free,
            setting.points,
            setting.answering,
            reference=setting.policy.reference,
            noticed=CHORDS_NOTICED * bound,
        )
        allowed = np.full(len(setting.points), bound - self._spent)
        bench = TrialRunner(
            setting.skeleton,
            found,
            BoundUsage(setting.skeleton, found, setting.points, allowed, replace(setting.bounds, max_error=bound)),
            setting.coding,
            np.array([self._droppable(i) for i in free], np.bool_),
            [self._task.shared[i] for i in free],
        )
        outcome = search(bench, bound, setting.effort)
        return None if outcome is None else _tracks(self._clip, found, outcome)


def _tracks(clip: Clip, found: SourceMotion, outcome: TrialResult) -> dict[int, tuple[Track, EncodedKeys]]:
    axes: dict[bytes, Floats] = {}
    result = {}
    for k, moving in enumerate(found.moving):
        if outcome.fates[k] == TrackAction.DROPPED:
            continue
        stored = outcome.keys[k]
        if k in outcome.on:
            keys = outcome.on[k]
            at = axes.setdefault(keys.tobytes(), times.key_times(found.grid[keys]))
        else:
            at = axes.setdefault(b"", times.key_times(np.array([clip.start])))
        result[moving.index] = _new_track(clip.tracks[moving.index], at, stored), stored
    return result


def _new_track(track: Track, at: Floats, stored: EncodedKeys) -> Track:
    return replace(
        track,
        interpolation=Interpolation.LINEAR,
        times=at,
        values=stored.exact(),
        in_tangents=None,
        out_tangents=None,
        storage=lossless.INT16 if stored.form in ("int16", "quaternion") else FLOAT32,
    )


def _with_ends(clip: Clip, every: dict[int, tuple[Track, EncodedKeys]], dropped: list[int]) -> Solution:
    """The solution, with at least one track, and with keys at the clip's start and end."""
    if not every and clip.tracks:
        every = {0: _unchanged(clip_ends.single_key(clip.tracks[0]))}
        dropped = [i for i in dropped if i != 0]
    made = Clip(clip.name, tuple(track for track, _ in every.values()))
    if every and (made.end < clip.end or made.start > clip.start):
        number = min(every, key=lambda i: (len(every[i][0].times), every[i][0].values.shape[1], i))
        every[number] = _unchanged(clip_ends.extend(every[number][0], clip.start, clip.end))
    ordered = [every[i] for i in sorted(every)]
    tracks, stored = tuple(track for track, _ in ordered), tuple(each for _, each in ordered)
    return Solution(Clip(clip.name, tracks), stored, tuple(dropped))


def _unchanged(track: Track) -> tuple[Track, EncodedKeys]:
    return track, EncodedKeys(track.values, "as it is")
