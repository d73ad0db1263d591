"""Removable keys of tracks with shared time axes: those whose removal saves bytes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from anim.arrays import Bools
from anim.gltf.validation.buffer_layout import COMPONENT_SIZES
from anim.model import Interpolation, TimeAxis, Track

AXIS_JSON_BYTES = 120  # approximate size of the JSON of an accessor for key times
TIME_BYTES = 4  # bytes of a key's time


def redundant_keys(tracks: Sequence[Track], given: Mapping[int, Bools]) -> dict[int, Bools]:
    """Return masks (K,) of keys to remove for a smaller file, by index of the tracks that have any.

    given: masks (K,) of the keys that are interpolated by their neighbors, by index of the track; constant tracks are
    absent and need no time axis. A key that no track on its time axis needs is removed; other keys only if a separate
    time axis costs less than they do.
    """
    common: dict[TimeAxis, Bools] = {}  # by time axis: keys that no track needs
    for i, mask in given.items():
        axis = tracks[i].time_axis
        common[axis] = common[axis] & mask if axis in common else mask
    masks = {}
    for i, own in given.items():
        if count := np.count_nonzero(own):
            shared = common[tracks[i].time_axis]
            saved = (count - np.count_nonzero(shared)) * _key_bytes(tracks[i])
            masks[i] = own if saved > AXIS_JSON_BYTES + TIME_BYTES * (len(own) - count) else shared
    return masks


def _key_bytes(track: Track) -> int:
    rows = 3 if track.interpolation is Interpolation.CUBICSPLINE else 1
    return int(rows * track.values.shape[1] * COMPONENT_SIZES[track.storage.component_type])
