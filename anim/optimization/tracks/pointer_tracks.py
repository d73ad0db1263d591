"""Tracks that move no node, in fewer keys: their values are their own measure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anim.model import Interpolation, Track, ValueKind
from anim.optimization.tracks.key_reduction import greedy_keys
from anim.optimization.tracks.lossless import reduce_lossless
from anim.sampling.track import sample

MARGIN = 0.9  # of the bound: lines are judged between keys, float32 rounds at them


def reduce_pointer_keys(track: Track, bound: float) -> Track:
    """Return a pointer track in fewer keys that is nowhere off by more than `bound`, a share of its range.

    Only lines are thinned; jumps and splines keep every key that changes something.
    """
    extent = float(np.ptp(track.values, axis=0).max(initial=0.0))
    if bound <= 0 or extent == 0 or track.interpolation is not Interpolation.LINEAR or track.kind is ValueKind.DISCRETE:
        return reduce_lossless(track)
    if track.kind is ValueKind.ROTATION:
        extent = 1.0
    scaled = sample(track, track.times) / (MARGIN * bound * extent)
    keep = greedy_keys(scaled[None], track.times)[0]
    return reduce_lossless(replace(track, times=track.times[keep], values=track.values[keep]))
