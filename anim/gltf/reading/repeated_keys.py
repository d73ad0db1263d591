"""Keys that many tracks share: a small file can move thousands of nodes by them."""

from __future__ import annotations

from collections.abc import Iterable

from anim.arrays import Identity
from anim.memory import MemoryBudget
from anim.model import Clip, Track

# Bytes of memory: 4 million keys in a small file. A crowd of 60 characters with 60 joints and 900 keys has fewer.
BYTES_PER_EDITED_KEY = 250
BYTES_PER_INSPECTED_KEY = 96


def check_repeated_keys(clips: Iterable[Clip], budget: MemoryBudget, bytes_per_key: int = BYTES_PER_EDITED_KEY) -> None:
    """Raise UnsupportedError if work on the keys that several tracks share would take more than the limit allows.

    Keys are counted once for each clip and node but the first one. Constant tracks and equal clips count nothing:
    commands work on one of them.
    """
    clips = list(clips)
    all_keys = sum(len(track.times) for clip in clips for track in clip.tracks)
    if not budget.is_within(bytes_per_key * all_keys):  # else which tracks share keys doesn't matter
        budget.check(bytes_per_key * count_repeated_keys(clips), "work on keys that many tracks share")


def count_repeated_keys(clips: Iterable[Clip]) -> int:
    """Return the number of keys of moving tracks that share their values with another, except those of the first."""
    uses: dict[Identity, tuple[Track, int]] = {}
    for tracks in {Identity(*clip.tracks): clip.tracks for clip in clips}.values():
        for track in tracks:
            shared = Identity(track.values)
            first, count = uses.get(shared, (track, 0))
            uses[shared] = first, count + 1
    return sum((count - 1) * len(track.times) for track, count in uses.values() if count > 1 and _moves(track))


def _moves(track: Track) -> bool:
    return bool((track.values != track.values[0]).any())
