"""The plan of a trial for one clip, and its solution."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import TypeAlias

from anim.arrays import Bools, Floats, Ints
from anim.gltf.validation.buffer_layout import COMPONENT_SIZES
from anim.model import Clip, Interpolation, Track
from anim.optimization.tracks.quantization import EncodedKeys, Encoding

Groups: TypeAlias = tuple[tuple[int, ...], ...]  # tracks that share a time axis

COMPONENTS = {Interpolation.STEP: 1, Interpolation.LINEAR: 1, Interpolation.CUBICSPLINE: 3}  # values per key


class TrackAction(IntEnum):
    """Treatment of a track."""

    DROPPED = 0
    CONSTANT = 1
    KEYED = 2


class RotationTarget(Enum):
    """Values that the keys of rotations approximate."""

    LOCAL = "the track's own values"
    WORLD = "the direction in the world that its node truly has"


@dataclass(frozen=True, slots=True)
class Plan:
    """Parameters of a trial.

    budgets: (G,) m, permitted error of each track. threshold: m, minimum tolerance for tracks to be dropped or
    constant. axes: layout of time axes, a name in LAYOUTS. coarser: (G,) factors on the tolerance of storage. groups:
    of the layout "groups", empty to find them.
    """

    budgets: Floats
    threshold: float
    axes: str
    coarser: Floats
    rotation_target: RotationTarget = RotationTarget.LOCAL
    groups: Groups = ()


@dataclass(frozen=True, slots=True)
class TrialResult:
    """Result of a plan.

    actions: (G,). keys: by track, as stored; none for dropped tracks. on: by keyed track, mask (K,) of its times on the
    grid. usage: (P,) the error of each point as a fraction of its bound. own: (G,) the same for bounds on single
    tracks. size: bytes.
    """

    plan: Plan
    actions: Ints
    keys: Mapping[int, EncodedKeys]
    on: Mapping[int, Bools]
    usage: Floats
    own: Floats
    size: float

    @property
    def groups(self) -> Groups:
        """The tracks of each time axis; different axes with equal keys count as one."""
        groups: dict[bytes, list[int]] = {}
        for i, keys in sorted(self.on.items()):
            groups.setdefault(keys.tobytes(), []).append(i)
        return tuple(map(tuple, groups.values()))

    @property
    def worst(self) -> float:
        """The largest fraction of any bound; all bounds hold up to 1."""
        return max(float(self.usage.max(initial=0.0)), float(self.own.max(initial=0.0)))


@dataclass(frozen=True, slots=True)
class FoundKeys:
    """Keys that a search found for G tracks of a clip.

    grid: (K,) s, possible key times. tracks: (G) indices in the clip. actions: (G,). keys: by position in `tracks`, as
    stored; none for dropped tracks. on: by position of keyed tracks, mask (K,) of their times on the grid.
    """

    grid: Floats
    tracks: tuple[int, ...]
    actions: Ints
    keys: Mapping[int, EncodedKeys]
    on: Mapping[int, Bools]


@dataclass(frozen=True, slots=True)
class Solution:
    """A clip in fewer bytes.

    stored: encoded keys of each track. dropped: indices of the source's tracks without a channel.
    """

    clip: Clip
    stored: tuple[EncodedKeys, ...]
    dropped: tuple[int, ...]

    def named(self, name: str) -> Solution:
        """Return the solution for a clip of equal tracks with another name."""
        return self if name == self.clip.name else Solution(Clip(name, self.clip.tracks), self.stored, self.dropped)

    def size(self, coding: Encoding) -> float:
        """Return the approximate number of bytes of the clip; equal values are stored once."""
        tracks, prices = self.clip.tracks, coding.byte_costs
        text = sum(prices.single_key if len(track.times) == 1 else prices.track for track in tracks)
        times = sum(prices.axis + 4 * len(axis) for axis in self.clip.time_axes)
        pairs = zip(tracks, self.stored, strict=True)
        plain = {_stored_values(track): value_bytes(track) for track, keys in pairs if not keys.codes}
        return text + times + sum(plain.values()) + coding.size([keys for keys in self.stored if keys.codes])


def _stored_values(track: Track) -> tuple[object, ...]:
    """Storage and values of a track: equal for tracks whose values are stored once."""
    parts = (track.values, track.in_tangents, track.out_tangents)
    return (track.storage, *(part.tobytes() for part in parts if part is not None))


def value_bytes(track: Track) -> int:
    """Return the bytes of a track's values, tangents included, in its storage format."""
    return COMPONENTS[track.interpolation] * COMPONENT_SIZES[track.storage.component_type] * track.values.size
