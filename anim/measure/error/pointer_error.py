"""Error of tracks that move no node: colors, factors, and other JSON pointers."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.model import Clip, Track, ValueKind
from anim.sampling.track import sample


def pointer_error(before: Clip, after: Clip, times: Floats) -> tuple[float, str]:
    """Return the largest error of such tracks as a fraction of the old range, and the track's pointer.

    Of a constant track the range is its size, of one at 0 the new track's. Tracks of only one of the clips don't count.
    times: (F,) s.
    """
    worst, where = 0.0, ""
    new = {track.target: track for track in after.tracks if track.path == "pointer"}
    for track in before.tracks:
        if track.path != "pointer" or track.target not in new:
            continue
        size = _relative_difference(track, new[track.target], times)
        if size > worst:
            worst, where = size, track.pointer or ""
    return worst, where


def _relative_difference(old: Track, new: Track, times: Floats) -> float:
    a, b = sample(old, times), sample(new, times)
    if old.kind is ValueKind.ROTATION:
        return float(np.minimum(np.abs(a - b).max(axis=1), np.abs(a + b).max(axis=1)).max())
    extents = (size for values in (a, b) for size in (np.ptp(values, axis=0).max(), np.abs(values).max()))
    return float(np.abs(a - b).max()) / next((float(extent) for extent in extents if extent > 0), 1.0)
