"""Tracks that share a time axis, stacked so that numpy's cost per call is paid once for all of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.model import Interpolation, Kind, Track
from anim.sampling.track import Located, interpolate, locate


@dataclass(frozen=True, slots=True)
class Batch:
    """G tracks with the same times, interpolation, kind and number of components.

    values, in_tangents, out_tangents: (K, G, C).
    """

    tracks: tuple[Track, ...]
    times: Floats
    values: Floats
    tangents: tuple[Floats, Floats] | None

    @property
    def interpolation(self) -> Interpolation:
        """The one interpolation of all tracks."""
        return self.tracks[0].interpolation

    @property
    def kind(self) -> Kind:
        """The one kind of all tracks."""
        return self.tracks[0].kind

    def sample(self, at: Floats, place: Located | None = None) -> Floats:
        """Return the values (F, G, C) at times `at` (F,); `place` saves the look-up where it is known."""
        place = place or locate(self.times, at)
        return interpolate(place, self.values, self.tangents, self.interpolation, self.kind)


def batches(tracks: Iterable[Track]) -> list[Batch]:
    """Return `tracks` stacked by time axis, path, interpolation and kind, in the order of their first members.

    Time axes are the same where they are one array: tracks read from one input accessor share it.
    """
    groups: dict[tuple[int, str, Interpolation, Kind, int], list[Track]] = {}
    for track in tracks:
        key = (id(track.times), track.path, track.interpolation, track.kind, track.values.shape[1])
        groups.setdefault(key, []).append(track)
    return [_stacked(tuple(group)) for group in groups.values()]


def _stacked(tracks: tuple[Track, ...]) -> Batch:
    values = np.stack([track.values for track in tracks], axis=1)
    tangents = None
    if tracks[0].interpolation is Interpolation.CUBICSPLINE:
        arriving = [track.in_tangents for track in tracks if track.in_tangents is not None]
        leaving = [track.out_tangents for track in tracks if track.out_tangents is not None]
        tangents = np.stack(arriving, axis=1), np.stack(leaving, axis=1)
    return Batch(tracks, tracks[0].times, values, tangents)
