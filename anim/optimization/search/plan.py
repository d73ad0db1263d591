"""A plan for one clip, and what it led to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, IntEnum

from anim.arrays import Bools, Floats, Ints
from anim.optimization.tracks.quantization import EncodedKeys


class TrackAction(IntEnum):
    """What becomes of a track."""

    DROPPED = 0
    HELD = 1
    KEYED = 2


class RotationTarget(Enum):
    """What the keys of rotations are to come near to."""

    LOCAL = "the track's own values"
    WORLD = "the direction in the world that its node truly has"


@dataclass(frozen=True, slots=True)
class Plan:
    """How a trial goes about it.

    budgets: (G,) m that each track may move a point. threshold: m, what a track may be off in any case to be dropped or
    held. axes: how time axes are chosen, a name of LAYOUTS. coarser: (G,) factors on what storing may miss.
    """

    budgets: Floats
    threshold: float
    axes: str
    coarser: Floats
    rotation_target: RotationTarget = RotationTarget.LOCAL


@dataclass(frozen=True, slots=True)
class TrialResult:
    """What a plan led to.

    fates: (G,). keys: by track, as stored; none of dropped ones. on: by keyed track, which times of the grid (K,) it
    has. strain: (P,) the error of each point, as a share of what it may be. own: (G,) the same for bounds on each track
    by itself. size: bytes.
    """

    plan: Plan
    fates: Ints
    keys: Mapping[int, EncodedKeys]
    on: Mapping[int, Bools]
    usage: Floats
    own: Floats
    size: float

    @property
    def worst(self) -> float:
        """The largest share of any bound; up to 1 all hold."""
        return max(float(self.usage.max(initial=0.0)), float(self.own.max(initial=0.0)))
