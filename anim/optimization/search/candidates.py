"""Candidates of tracks on time axes: encoded keys, and the played values between them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, Ints
from anim.optimization.options import Packing
from anim.optimization.search import playback
from anim.optimization.search.key_fit import KeyFit
from anim.optimization.search.source_motion import PATHS, ROTATION, SourceMotion
from anim.optimization.search.time_axes import SharedAxis
from anim.optimization.tracks import quantization
from anim.optimization.tracks.clip_ends import close_ends
from anim.optimization.tracks.quantization import EncodedKeys, Form
from anim.sampling.track import KeyInterval, find_interval

MAX_CACHED_VALUES = 10_000_000  # a larger cache is cleared


@dataclass(frozen=True, slots=True)
class Candidate:
    """One track with its keys. shown: (W, C), played values at the measurement times."""

    stored: EncodedKeys
    shown: Floats


class Candidates:
    """Candidates for the tracks of one clip, each computed once and cached for later trials."""

    def __init__(self, source: SourceMotion, packing: Packing) -> None:
        self._source = source
        self._packing = packing
        self._paths = [PATHS.index(each.path) for each in source.moving]
        self._values, self._rows = _stacked(source, self._paths)
        self._closures = np.array([each.closure for each in source.moving])
        self._intervals: dict[bytes, KeyInterval] = {}
        self._fits: dict[bytes, KeyFit] = {}
        self._keys: dict[tuple[bytes, int], Floats] = {}
        self._made: dict[tuple[bytes, int, Form], Candidate] = {}
        self._num_cached = 0

    def of(self, axis: SharedAxis, tolerances: Sequence[float]) -> Iterable[tuple[int, Candidate]]:
        """Return every member of an axis with its candidate. tolerances: (G,) for storage, in units of values."""
        self._trim_cache()
        name = axis.keys.tobytes()
        self._fit(axis, name)
        forms = {
            i: quantization.choose_format(self._keys[name, i], PATHS[self._paths[i]], tolerances[i], self._packing)
            for i in axis.members
        }
        new = [i for i in axis.members if (name, i, forms[i]) not in self._made]
        for path in range(len(PATHS)):
            self._make(axis, name, [i for i in new if self._paths[i] == path], forms, rotations=path == ROTATION)
        return [(i, self._made[name, i, forms[i]]) for i in axis.members]

    def compensated(
        self, axis: SharedAxis, members: Sequence[int], targets: Floats, tolerances: Sequence[float]
    ) -> list[Candidate]:
        """Return candidates for the `members` of an axis with rotations `targets` (W, G, 4).

        The targets replace the tracks' own values.
        """
        self._trim_cache()
        place = self._interval(axis, axis.keys.tobytes())
        keys = targets[self._source.on_grid[axis.keys]]
        if not axis.keys.all():
            keys = self._fit_on(axis, axis.keys.tobytes()).rotations(targets, keys)
        by_track = list(np.moveaxis(close_ends(keys, self._closures[list(members)]), 1, 0))
        forms = [
            quantization.choose_format(by_track[k], "rotation", tolerances[i], self._packing)
            for k, i in enumerate(members)
        ]
        return _candidates(quantization.encode_all(by_track, forms), place, rotations=True)

    def by_chords(self, axis: SharedAxis, rotations: Sequence[EncodedKeys]) -> Floats:
        """Return the values (W, G, 4) of rotations on an axis in players with component-wise interpolation."""
        keys = np.stack([each.values for each in rotations], axis=1)
        return playback.nlerp(keys, self._interval(axis, axis.keys.tobytes()))

    def _make(
        self, axis: SharedAxis, name: bytes, members: list[int], forms: dict[int, Form], *, rotations: bool
    ) -> None:
        if not members:
            return
        stored = quantization.encode_all([self._keys[name, i] for i in members], [forms[i] for i in members])
        made = _candidates(stored, self._interval(axis, name), rotations=rotations)
        self._made.update(((name, i, forms[i]), each) for i, each in zip(members, made, strict=True))
        self._num_cached += sum(each.shown.size + each.stored.values.size for each in made)

    def _fit(self, axis: SharedAxis, name: bytes) -> None:
        """Compute keys of new members of the axis: their own values if it has every key, else a fit."""
        at = self._source.on_grid[axis.keys]
        for path in range(len(PATHS)):
            new = [i for i in axis.members if self._paths[i] == path and (name, i) not in self._keys]
            if not new:
                continue
            values = self._values[path][:, self._rows[new]]
            keys = values[at]
            if not axis.keys.all():
                fit = self._fit_on(axis, name)
                keys = fit.rotations(values, keys) if path == ROTATION else fit.vectors(values)
            keys = close_ends(keys, self._closures[new])
            for k, i in enumerate(new):
                self._keys[name, i] = keys[:, k]

    def _trim_cache(self) -> None:
        if self._num_cached <= MAX_CACHED_VALUES:
            return
        for kept in (self._intervals, self._fits, self._keys, self._made):
            kept.clear()
        self._num_cached = 0

    def _fit_on(self, axis: SharedAxis, name: bytes) -> KeyFit:
        if name not in self._fits:
            self._fits[name] = fit = KeyFit(self._interval(axis, name), int(axis.keys.sum()))
            self._num_cached += fit.num_values
        return self._fits[name]

    def _interval(self, axis: SharedAxis, name: bytes) -> KeyInterval:
        if name not in self._intervals:
            self._intervals[name] = find_interval(self._source.grid[axis.keys], self._source.at)
            self._num_cached += 4 * len(self._source.at)
        return self._intervals[name]


def _stacked(source: SourceMotion, paths: Sequence[int]) -> tuple[list[Floats], Ints]:
    """The values (W, G', C) of all tracks of each path, and the index (G,) of each track among them."""
    values, rows = [], np.zeros(len(paths), np.int64)
    for path in range(len(PATHS)):
        mine = [i for i, each in enumerate(paths) if each == path]
        rows[mine] = np.arange(len(mine))
        values.append(np.stack([source.moving[i].values for i in mine], axis=1) if mine else np.empty((0, 0, 0)))
    return values, rows


def _candidates(stored: Sequence[EncodedKeys], place: KeyInterval, *, rotations: bool) -> list[Candidate]:
    keys = np.stack([each.values for each in stored], axis=1)
    play = playback.slerp_raw if rotations and len(keys) > 1 else playback.linear_error
    shown = play(keys, place)
    return [Candidate(each, shown[:, k]) for k, each in enumerate(stored)]
