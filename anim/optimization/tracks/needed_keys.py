"""Keys of tracks that their neighbors do not interpolate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Bools, Ints
from anim.measure.inspect.track_statistics import removable_keys
from anim.model import Skeleton, Track
from anim.model.track import share_time_axes


def needed_keys(tracks: Sequence[Track], skeleton: Skeleton) -> list[tuple[Track, Bools]]:
    """Return each track without redundant keys, and the mask (K,) of its keys that stay.

    Tracks that share a time axis are judged together; new axes are shared. Constant tracks keep all keys.
    (keys at 0, 1, 2 s with the values 0, 5, 10) → keys at 0, 2 s and [True, False, True]
    """
    counts = [len(track.times) for track in tracks]
    kept = [np.arange(len(track.times)) for track in tracks]
    while True:  # a removed key can make others necessary
        masks = [_alternate_keys(mask) for mask in removable_keys(tracks, skeleton)]
        if not any(mask.any() for mask in masks):
            return [(track, _mask(stay, old)) for track, stay, old in zip(tracks, kept, counts, strict=True)]
        kept = [stay[~mask] for stay, mask in zip(kept, masks, strict=True)]
        pairs = zip(tracks, masks, strict=True)
        tracks = share_time_axes(_select_keys(track, ~mask) if mask.any() else track for track, mask in pairs)


def _mask(kept: Ints, count: int) -> Bools:
    mask = np.zeros(count, np.bool_)
    mask[kept] = True
    return mask


def _alternate_keys(mask: Bools) -> Bools:
    """The first, third, … key of every run: a key is redundant only if its neighbors stay."""
    if not mask.any():
        return mask
    begins = np.flatnonzero(mask & ~np.concatenate(([False], mask[:-1])))
    at = np.arange(len(mask))
    run = np.searchsorted(begins, at, side="right") - 1
    since = at - begins[run]
    return np.asarray(mask & (since % 2 == 0))


def _select_keys(track: Track, keep: Bools) -> Track:
    arriving, leaving = (None if part is None else part[keep] for part in (track.in_tangents, track.out_tangents))
    return track.with_keys(track.times[keep], track.values[keep], arriving, leaving)
