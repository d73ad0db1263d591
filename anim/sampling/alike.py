"""Groups of tracks with the same path, interpolation and type, which can be sampled as one array."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from anim.arrays import Floats, Ints
from anim.model import Interpolation, Track, ValueKind
from anim.model.track import PATHS

Rule: TypeAlias = tuple[str, Interpolation, ValueKind, int]
Tangents: TypeAlias = tuple[Floats, Floats]

_KINDS = {path: ValueKind.ROTATION if path == "rotation" else ValueKind.VECTOR for path in PATHS}


@dataclass(frozen=True, slots=True)
class TrackGroup:
    """T tracks of one rule: see `rule`. numbers: (T,) indices among those given."""

    tracks: tuple[Track, ...]
    numbers: Ints

    @property
    def path(self) -> str:
        """Path of all tracks."""
        return self.tracks[0].path

    @property
    def interpolation(self) -> Interpolation:
        """Interpolation of all tracks."""
        return self.tracks[0].interpolation

    @property
    def kind(self) -> ValueKind:
        """Value type of all tracks."""
        return self.tracks[0].kind


def rule(track: Track) -> Rule:
    """Return the grouping key of a track: path, interpolation, value type, number of components."""
    kind = _KINDS[track.path] if track.pointer is None and track.path in _KINDS else track.kind
    return track.path, track.interpolation, kind, track.values.shape[1]


def stack_values(tracks: Sequence[Track], join: Callable[[Sequence[Floats]], Floats]) -> tuple[Floats, Tangents | None]:
    """Return the values of tracks of one rule, and their in and out tangents, None without CUBICSPLINE.

    join: makes one array of each track's (K, C).
    """
    values = join([track.values for track in tracks])
    if tracks[0].interpolation is not Interpolation.CUBICSPLINE:
        return values, None
    arriving = [track.in_tangents for track in tracks if track.in_tangents is not None]
    leaving = [track.out_tangents for track in tracks if track.out_tangents is not None]
    return values, (join(arriving), join(leaving))
