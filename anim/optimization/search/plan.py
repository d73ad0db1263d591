"""The plan of a trial for one clip, and its result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, IntEnum

from anim.arrays import Bools, Floats, Ints
from anim.optimization.tracks.quantization import EncodedKeys


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
    constant. axes: layout of time axes, a name in LAYOUTS. coarser: (G,) factors on the tolerance of storage.
    """

    budgets: Floats
    threshold: float
    axes: str
    coarser: Floats
    rotation_target: RotationTarget = RotationTarget.LOCAL


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
    def worst(self) -> float:
        """The largest fraction of any bound; all bounds hold up to 1."""
        return max(float(self.usage.max(initial=0.0)), float(self.own.max(initial=0.0)))
