"""Clips with equal tracks: they move alike, so that one measurement is enough for all of them."""

from __future__ import annotations

import operator
from collections import Counter
from collections.abc import Sequence

from anim.model import Clip


def first_equal(items: Sequence[tuple[Clip, ...]]) -> list[int]:
    """Return for each item the index of the first one with equal clips, whatever their names.

    first_equal([(walk,), (run,), (walk_copy,)]) → [0, 1, 0]
    """
    sizes = [tuple(map(_size, item)) for item in items]
    counts = Counter(sizes)
    first: dict[object, int] = {}
    return [
        first.setdefault(tuple(map(track_digests, item)) if counts[size] > 1 else i, i)
        for i, (item, size) in enumerate(zip(items, sizes, strict=True))
    ]


def track_digests(clip: Clip) -> tuple[bytes, ...]:
    """Return the digests of a clip's tracks: those of equal clips are equal, whatever their names."""
    return tuple([track.digest for track in clip.tracks])


def repeat_change(clip: Clip, old: Clip, new: Clip) -> Clip:
    """Return a clip after the change that made `new` of `old`, a clip with equal tracks; itself if nothing changed."""
    is_same = len(new.tracks) == len(old.tracks) and all(map(operator.is_, new.tracks, old.tracks))
    return clip if is_same else Clip(clip.name, new.tracks)


def _size(clip: Clip) -> tuple[int, ...]:
    """Numbers of values: without this most clips would be hashed for nothing."""
    return tuple([track.values.size for track in clip.tracks])
