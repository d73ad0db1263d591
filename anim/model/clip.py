"""Clip: a glTF animation in memory: tracks that play together."""

from __future__ import annotations

from dataclasses import dataclass

from anim.errors import FormatError
from anim.model.track import Track


@dataclass(frozen=True, slots=True)
class Clip:
    """Tracks under one name, at most one per property of a node.

    name: as in the file; empty where it has none.
    """

    name: str
    tracks: tuple[Track, ...]

    def __post_init__(self) -> None:
        seen: set[tuple[int | None, str]] = set()
        for track in self.tracks:
            if track.node is not None and track.target in seen:
                raise FormatError(f"two tracks for the same target {track.target}", where=f"clip '{self.name}'")
            seen.add(track.target)

    @property
    def start(self) -> float:
        """Time of the first key, in seconds; 0 where there is no track."""
        return min((float(track.times[0]) for track in self.tracks), default=0.0)

    @property
    def end(self) -> float:
        """Time of the last key, in seconds: glTF's length of the animation, which always starts at 0."""
        return max((float(track.times[-1]) for track in self.tracks), default=0.0)
