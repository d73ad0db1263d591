"""Request of an optimization: error bounds, permitted removals, and search effort."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum

DEFAULT_MAX_ERROR = "0.01%"  # of the diagonal
PLAYERS = ("spec", "three", "raw", "nlerp")  # "three" can exceed both others: 3 % on Fox


class Drop(StrEnum):
    """Removal of channels that only repeat the rest pose."""

    REST = "rest"  # each channel within the bound of the rest pose, clip by clip
    UNUSED = "unused"  # only properties at rest in all clips: safe for players that blend clips
    NEVER = "never"  # none; such channels become a single key


class Reference(StrEnum):
    """The times at which the result must match the source."""

    CURVE = "curve"  # all times
    KEYS = "keys"  # the source's key times


class Packing(StrEnum):
    """The storage of animation data."""

    CORE = "core"  # plain accessors, supported by every player
    EXT = "ext"  # EXT_meshopt_compression
    KHR = "khr"  # KHR_meshopt_compression, bitstream version 1

    @property
    def extension(self) -> str:
        """The glTF extension required; empty for none."""
        return {"core": "", "ext": "EXT_meshopt_compression", "khr": "KHR_meshopt_compression"}[self.value]


class Objective(StrEnum):
    """The size that a search minimizes."""

    FILE = "file"  # bytes on disk
    GZIP = "gzip"  # bytes after gzip, where JSON is nearly free


@dataclass(frozen=True, slots=True)
class Bounds:
    """Error bounds of the result against the source.

    max_error: m on the surface, 0 for lossless in float32. shell: m, radius of the shell points around nodes without
    vertices. max_pointer_error: fraction of the range of a track that moves no node. max_angle: rad of any node's world
    rotation, or None. max_speed_error: m/s of any vertex, or None.
    """

    max_error: float
    shell: float
    max_pointer_error: float = 1e-4
    max_angle: float | None = None
    max_speed_error: float | None = None


@dataclass(frozen=True, slots=True)
class Policy:
    """Permitted removals and changes apart from keys.

    keep: indices of the nodes whose channels stay exact. rebase_rest: whether the rest pose may change if every
    clip animates the property. drop_invisible: whether channels of nodes without vertices may be dropped.
    """

    drop: Drop = Drop.UNUSED
    reference: Reference = Reference.CURVE
    rebase_rest: bool = False
    drop_invisible: bool = False
    keep: frozenset[int] = frozenset()


@dataclass(frozen=True, slots=True)
class Effort:
    """The extent of a search.

    rounds: of feedback. groups: layouts that find groups of tracks with an axis each. thresholds: fractions of the
    bound tried as tolerance for constant tracks. axes: further layouts of time axes. long_track_rounds: rounds with
    larger budgets for long tracks. leeways: exponents on the budget gain of world-space compensation. finishing:
    factors tried on all budgets at the end. random_trials: number of random changes. coarsen_passes: passes of coarser
    storage, track by track, with a codec. cycles: maximum repetitions of all stages, as long as one saves bytes.
    also_try: another effort; the smaller result counts.
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
    groups: tuple[str, ...] = ()

    def all(self) -> list[Effort]:
        """Return all efforts to run in turn; the smallest result counts."""
        return [*(self.also_try.all() if self.also_try else ()), self]


GROUPS = ("wide groups", "groups")  # names in LAYOUTS
FAST = Effort(4)
BALANCED = Effort(5, (0.4,), (), 3, (), (1.1, 1.05), random_trials=12, groups=GROUPS)
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
    groups=GROUPS,
)
EFFORTS = {"fast": FAST, "balanced": BALANCED, "max": MAX}
# Under a codec, upper joints that are compensated take fewer bits and not only fewer keys. In core glTF, compensation
# and more random changes save 0.4 % of the animations of Knight and take a quarter of the time.
BALANCED_CODEC = replace(BALANCED, leeways=(0.0, 0.5), random_trials=20, coarsen_passes=2)
CODEC_EFFORTS = {"balanced": BALANCED_CODEC, "max": replace(MAX, also_try=BALANCED_CODEC)}


def find_effort(name: str, packing: Packing) -> Effort:
    """Return the effort of a name in EFFORTS for a storage."""
    return EFFORTS[name] if packing is Packing.CORE else CODEC_EFFORTS.get(name, EFFORTS[name])


@dataclass(frozen=True, slots=True)
class Request:
    """Bounds, policy, storage and effort of an optimization.

    effort: a name in EFFORTS. players: names in PLAYERS; the bounds hold for each. given: the bounds as given, if
    relative to the diagonal: another rest pose has another diagonal, but the request is the same.
    """

    bounds: Bounds
    policy: Policy = field(default_factory=Policy)
    packing: Packing = Packing.CORE
    objective: Objective = Objective.FILE
    effort: str = "balanced"
    players: tuple[str, ...] = PLAYERS
    given: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Text that is equal for equal requests."""
        return repr(replace(self, bounds=Bounds(0.0, 0.0)) if self.given else self)

    def with_bound(self, max_error: float) -> Request:
        """Return the request with a computed bound in metres."""
        return replace(self, bounds=replace(self.bounds, max_error=max_error), given=())
