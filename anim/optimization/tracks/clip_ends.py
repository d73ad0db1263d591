"""Single keys of constant tracks, and keys that preserve the clip's start and end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anim.model import Interpolation, Track


def single_key(track: Track) -> Track:
    """Return the first value of a track as its only key."""
    return replace(
        track,
        interpolation=Interpolation.STEP if track.interpolation is Interpolation.STEP else Interpolation.LINEAR,
        times=track.times[:1],
        values=track.values[:1],
        in_tangents=None,
        out_tangents=None,
    )


def extend(track: Track, start: float, end: float) -> Track:
    """Return the track with its first value constant from `start`, its last up to `end`.

    Splines get zero tangents there.
    """
    head, tail = bool(track.times[0] > start), bool(track.times[-1] < end)
    inner = slice(1, None) if head and tail and len(track.times) == 1 else slice(None)  # two keys hold one value
    rows = [0] * head + list(range(len(track.times))[inner]) + [-1] * tail
    at = np.concatenate(([start] * head, track.times[inner], [end] * tail))
    new = replace(
        track,
        times=at,
        values=track.values[rows],
        in_tangents=None,
        out_tangents=None,
        interpolation=Interpolation.STEP,
    )
    if track.in_tangents is None or track.out_tangents is None:
        return replace(new, interpolation=track.interpolation)
    arriving, leaving = track.in_tangents[rows], track.out_tangents[rows]
    if head:
        leaving[0] = arriving[1] = 0
    if tail:
        leaving[-2] = arriving[-1] = 0
    return replace(new, interpolation=track.interpolation, in_tangents=arriving, out_tangents=leaving)
