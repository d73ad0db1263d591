"""Lower bound of the bytes of a lossless clip, without the clip."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats, Ints
from anim.gltf.validation.buffer_layout import COMPONENT_SIZES
from anim.model import Interpolation, TimeAxis, Track
from anim.optimization.tracks.quantization import ByteCosts

INT16_SIZE = 2  # bytes of a component; rotations may be stored so without loss


def min_lossless_bytes(tracks: Sequence[Track], costs: ByteCosts) -> float:
    """Return bytes that `key_reduction.reduce_lossless` of all tracks takes at least, times and constants apart.

    Tracks on one time axis are counted together, and tracks of equal values once. Pointers count nothing: they have a
    bound of their own.
    """
    seen: set[bytes] = set()
    groups: dict[tuple[TimeAxis, Interpolation, int, int], list[Floats]] = {}
    for track in tracks:
        if track.node is None or (data := track.values.tobytes()) in seen:
            continue
        seen.add(data)
        size = COMPONENT_SIZES[track.storage.component_type]
        component = min(size, INT16_SIZE) if track.path == "rotation" else size
        key = track.time_axis, track.interpolation, track.values.shape[1], component
        groups.setdefault(key, []).append(track.values)
    total = 0.0
    for (_, interpolation, width, component), values in groups.items():
        kept = _retained_keys(np.array(values), interpolation)
        parts = 3 if interpolation is Interpolation.CUBICSPLINE else 1
        total += costs.track * np.count_nonzero(kept) + parts * component * width * int(kept.sum())
    return total


def _retained_keys(values: Floats, interpolation: Interpolation) -> Ints:
    """For each of G tracks (G, K, C) its count of keys after the reduction; 0 for constant ones."""
    same = (values[:, 1:] == values[:, :-1]).all(axis=2)  # equal to the previous key
    count = values.shape[1]
    if interpolation is Interpolation.STEP:
        kept = count - same.sum(axis=1)
    elif interpolation is Interpolation.CUBICSPLINE:
        kept = np.full(len(values), count)
    else:
        ends = np.ones((len(values), 1), np.bool_)
        kept = count - (np.hstack((ends, same)) & np.hstack((same, ends))).sum(axis=1)
    return np.asarray(np.where(same.all(axis=1), 0, kept))
