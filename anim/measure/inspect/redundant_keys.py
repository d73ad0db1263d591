"""Which keys of tracks that share time axes can go, and save bytes by that."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from anim.arrays import Bools
from anim.model import Interpolation, TimeAxis, Track

AXIS_JSON = 120  # bytes that one more accessor for key times takes, about
TIME = 4  # bytes of a key's time
SIZES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}  # bytes, by glTF's component type


def redundant_keys(tracks: Sequence[Track], given: Mapping[int, Bools]) -> list[Bools]:
    """Return which keys (K,) of each track can go so that the file gets smaller.

    given: by number of a track that moves, which keys (K,) their neighbors give anyway; tracks that it lacks move
    nothing, and need no axis. A key that every track on its time axis can do without goes; other keys only where a
    time axis of the track's own costs less than they take.
    """
    common: dict[TimeAxis, Bools] = {}  # by time axis: keys that no track needs
    for i, mask in given.items():
        axis = tracks[i].time_axis
        common[axis] = common[axis] & mask if axis in common else mask
    masks = [np.zeros(len(track.times), np.bool_) for track in tracks]
    for i, own in given.items():
        if count := np.count_nonzero(own):
            shared = common[tracks[i].time_axis]
            saved = (count - np.count_nonzero(shared)) * _key_bytes(tracks[i])
            masks[i] = own if saved > AXIS_JSON + TIME * (len(own) - count) else shared
    return masks


def _key_bytes(track: Track) -> int:
    rows = 3 if track.interpolation is Interpolation.CUBICSPLINE else 1
    return int(rows * track.values.shape[1] * SIZES[track.storage.component_type])
