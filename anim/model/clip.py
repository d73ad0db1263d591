"""Clip: a glTF animation in memory."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from anim.arrays import Floats
from anim.errors import FormatError, ShapeError
from anim.model.time_axis import TimeAxis, merge_times
from anim.model.track import Track


@dataclass(frozen=True, slots=True)
class Clip:
    """Named set of tracks, at most one per property of a node.

    name: as in the file; empty if it has none.
    """

    name: str
    tracks: tuple[Track, ...]
    _time_axes: tuple[TimeAxis, ...] | None = field(
        init=False, repr=False, compare=False, default=None
    )  # once asked for

    def __post_init__(self) -> None:
        if not isinstance(self.name, str):
            raise ShapeError(f"name is {self.name!r} (expected text, empty for none)")
        if not isinstance(self.tracks, tuple):
            object.__setattr__(self, "tracks", _as_tuple(self.tracks))
        if not self.tracks:  # of tens of thousands, in some files
            return
        if strange := [each for each in self.tracks if not isinstance(each, Track)]:
            raise ShapeError(f"tracks hold {type(strange[0]).__name__} (expected Track)")
        targets = [(track.node, track.path) for track in self.tracks if track.node is not None]
        if len(set(targets)) < len(targets):
            node, path = next(target for target in targets if targets.count(target) > 1)
            raise FormatError(f"two tracks for node {node}, {path}", where=f"clip '{self.name}'" if self.name else "")

    @property
    def time_axes(self) -> tuple[TimeAxis, ...]:
        """Distinct time axes, in the order of the tracks."""
        if self._time_axes is None:  # operations ask for the end at every track
            object.__setattr__(self, "_time_axes", tuple(dict.fromkeys([track.time_axis for track in self.tracks])))
        return self._time_axes or ()

    @property
    def key_times(self) -> Floats:
        """Distinct key times of all tracks in seconds, increasing; 0 without tracks."""
        return merge_times(self.time_axes) if self.tracks else np.zeros(1)

    @property
    def start(self) -> float:
        """Time of the first key, in seconds; 0 without tracks."""
        return min([float(axis.times[0]) for axis in self.time_axes]) if self.tracks else 0.0

    @property
    def end(self) -> float:
        """Time of the last key, in seconds: the animation's duration in glTF, where it always starts at 0."""
        return max([float(axis.times[-1]) for axis in self.time_axes]) if self.tracks else 0.0

    @property
    def num_bytes(self) -> int:
        """Bytes of the values and tangents of all tracks, as in memory."""
        arrays = (each for track in self.tracks for each in (track.values, track.in_tangents, track.out_tangents))
        return sum(each.nbytes for each in arrays if each is not None)

    def __repr__(self) -> str:
        return f"Clip({self.name!r}, tracks={len(self.tracks)}, start_s={self.start:.6g}, end_s={self.end:.6g})"


def _as_tuple(tracks: Iterable[Track]) -> tuple[Track, ...]:
    try:
        return tuple(tracks)
    except TypeError:
        raise ShapeError(f"tracks is {type(tracks).__name__} (expected a sequence of Track)") from None
