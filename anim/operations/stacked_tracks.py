"""Tracks of one time axis as one array, changed together: thousands take as many calls as one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from anim.arrays import Bools, Floats, freeze
from anim.model import Clip, Interpolation, TimeAxis, Track, ValueKind
from anim.sampling.lazy_batch import lazy_batches


@dataclass(frozen=True, slots=True, eq=False)
class StackedTracks:
    """G tracks of one path, interpolation and kind on one time axis, or what becomes of them.

    values: (K, G, C). in_tangents, out_tangents: (K, G, C) per second, for CUBICSPLINE only.
    """

    tracks: tuple[Track, ...]
    interpolation: Interpolation
    time_axis: TimeAxis
    values: Floats
    in_tangents: Floats | None = None
    out_tangents: Floats | None = None

    @property
    def kind(self) -> ValueKind:
        """Type of the values."""
        return self.tracks[0].kind

    @property
    def times(self) -> Floats:
        """Key times (K,) in seconds."""
        return self.time_axis.times

    def with_keys(
        self,
        times: TimeAxis | ArrayLike,
        values: Floats,
        in_tangents: Floats | None = None,
        out_tangents: Floats | None = None,
        *,
        interpolation: Interpolation | None = None,
    ) -> StackedTracks:
        """Return the stack with other keys, and with another interpolation if given."""
        axis = times if isinstance(times, TimeAxis) else TimeAxis(times)
        return StackedTracks(self.tracks, interpolation or self.interpolation, axis, values, in_tangents, out_tangents)

    def pick(self, chosen: Bools) -> StackedTracks:
        """Return the stack of the chosen tracks (G,)."""
        if chosen.all():
            return self
        parts = (self.values, self.in_tangents, self.out_tangents)
        values, before, after = (None if part is None else part[:, chosen] for part in parts)
        assert values is not None
        tracks = tuple(track for track, is_one in zip(self.tracks, chosen.tolist(), strict=True) if is_one)
        return replace(self, tracks=tracks, values=values, in_tangents=before, out_tangents=after)

    def split(self) -> list[Track]:
        """Return the tracks with the keys of the stack."""
        parts = (self.values, self.in_tangents, self.out_tangents)
        keys = zip(*(_by_track(part, len(self.tracks)) for part in parts), strict=True)
        return [
            track.with_keys(self.time_axis, values, before, after, interpolation=self.interpolation)
            for track, (values, before, after) in zip(self.tracks, keys, strict=True)
        ]


def change_tracks(clip: Clip, chosen: frozenset[int], change: Callable[[StackedTracks], Sequence[Track]]) -> Clip:
    """Return the clip with some tracks, by index, replaced by those that `change` makes of each stack, in its order."""
    numbers = sorted(chosen)
    new = list(clip.tracks)
    for batch in (part.whole for each in lazy_batches(clip.tracks[i] for i in numbers) for part in each.divide()):
        stack = StackedTracks(batch.tracks, batch.interpolation, batch.time_axis, batch.values, *(batch.tangents or ()))
        for i, track in zip(batch.numbers.tolist(), change(stack), strict=True):
            new[numbers[i]] = track
    return Clip(clip.name, tuple(new))


def _by_track(values: Floats | None, count: int) -> Sequence[Any]:
    """Values (K, C) of each track, read-only, so that tracks share them."""
    return [None] * count if values is None else list(freeze(np.ascontiguousarray(values.swapaxes(0, 1))))
