"""What an optimization may cost the motion, what it may remove, and how hard it tries: all options in three values."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Drop(StrEnum):
    """Which channels that only repeat the rest pose may go."""

    REST = "rest"  # every channel that stays within the bound of the rest pose, clip by clip
    UNUSED = "unused"  # only what no clip ever moves away from the rest pose: safe where a player blends clips
    NEVER = "never"  # none; they become a single key


class Reference(StrEnum):
    """What the result must stay near to."""

    CURVE = "curve"  # the motion at every moment
    KEYS = "keys"  # the motion at the source's key times


class Packing(StrEnum):
    """How the numbers of animations are stored."""

    CORE = "core"  # plain accessors: every player reads them
    EXT = "ext"  # EXT_meshopt_compression
    KHR = "khr"  # KHR_meshopt_compression, bitstream version 1

    @property
    def extension(self) -> str:
        """The glTF extension it needs; empty for none."""
        return {"core": "", "ext": "EXT_meshopt_compression", "khr": "KHR_meshopt_compression"}[self.value]


class Objective(StrEnum):
    """What is counted when two ways compete."""

    FILE = "file"  # bytes on disk
    GZIP = "gzip"  # bytes after gzip, where JSON is nearly free


@dataclass(frozen=True, slots=True)
class Bounds:
    """How far the result may be from the source.

    max_error: m on the surface, 0 for lossless in float32. shell: m, radius of the sphere on which a node without
    vertices counts. max_pointer_error: share of the range of a track that moves no node. max_angle: rad of any node's
    own rotation, or None. max_speed_error: m/s of any vertex, or None.
    """

    max_error: float
    shell: float
    max_pointer_error: float = 1e-4
    max_angle: float | None = None
    max_speed_error: float | None = None


@dataclass(frozen=True, slots=True)
class Policy:
    """What may be removed or moved beside keys.

    keep: numbers of the nodes whose channels stay exact. rebase_rest: the rest pose may move where every
    clip drives the property. drop_invisible: channels of nodes that carry no vertex may go.
    """

    drop: Drop = Drop.UNUSED
    reference: Reference = Reference.CURVE
    rebase_rest: bool = False
    drop_invisible: bool = False
    keep: frozenset[int] = frozenset()


@dataclass(frozen=True, slots=True)
class Effort:
    """How long a search goes on.

    rounds: of feedback. thresholds: shares of the bound tried as what a track may be off to be held. axes: further
    ways to choose time axes. favoring: rounds with more room for long tracks. leeways: where rotations make up for each
    other, how much of what that shortens levers by is given to their budgets at once, as powers. finishing: factors
    tried on all budgets at the end. strays: random changes tried. descent: times that each track is tried with coarser
    storage, where a codec makes that smaller. cycles: times that all of this is done at most, as long as it saves
    bytes. besides: another effort, whose result counts where it is smaller.
    """

    rounds: int
    thresholds: tuple[float, ...] = ()
    axes: tuple[str, ...] = ()
    long_track_rounds: int = 0
    leeways: tuple[float, ...] = ()
    finishing: tuple[float, ...] = (1.05,)
    random_trials: int = 0
    coarsen_passes: int = 0
    cycles: int = 1
    also_try: Effort | None = None

    def all(self) -> list[Effort]:
        """Return the efforts that are made one after the other: the smallest result counts."""
        return [*(self.also_try.all() if self.also_try else ()), self]


FAST = Effort(5)
BALANCED = Effort(5, (0.25, 0.6), ("full",), 5, (0.0, 0.5), (1.1, 1.05), random_trials=25, coarsen_passes=2)
MAX = Effort(
    10,
    (0.1, 0.25, 0.4, 0.6, 0.8),
    ("full", "joint", "second", "third"),
    10,
    (0.0, 0.25, 0.5, 0.75),
    (1.2, 1.1, 1.05, 1.02),
    random_trials=100,
    coarsen_passes=2,
    cycles=3,
    also_try=BALANCED,
)
EFFORTS = {"fast": FAST, "balanced": BALANCED, "max": MAX}
