"""Tracks that share a time axis, stacked so that numpy's cost per call is paid once for all of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial

import numpy as np

from anim.arrays import Floats
from anim.model import Track
from anim.sampling.alike import Alike, Rule, Tangents, put_together, rule
from anim.sampling.track import Located, interpolate, locate


@dataclass(frozen=True, slots=True)
class Batch(Alike):
    """G tracks of one rule and with the same times.

    times: (K,) s. values: (K, G, C). tangents: in and out, both (K, G, C) per second, for CUBICSPLINE.
    """

    times: Floats
    values: Floats
    tangents: Tangents | None

    def sample(self, at: Floats, place: Located | None = None) -> Floats:
        """Return the values (F, G, C) at times `at` (F,); `place` saves the look-up where it is known."""
        place = place or locate(self.times, at)
        return interpolate(place, self.values, self.tangents, self.interpolation, self.kind)


def batches(tracks: Iterable[Track]) -> list[Batch]:
    """Return `tracks` stacked by time axis and `alike.rule`, in the order of their first members.

    Time axes are the same where they are one array: tracks read from one input accessor share it.
    """
    groups: dict[tuple[int, Rule], list[Track]] = {}
    for track in tracks:
        groups.setdefault((id(track.times), rule(track)), []).append(track)
    return [_stacked(tuple(group)) for group in groups.values()]


def _stacked(tracks: tuple[Track, ...]) -> Batch:
    return Batch(tracks, tracks[0].times, *put_together(tracks, partial(np.stack, axis=1)))
