"""Lower bound of the bytes of a lossless clip, without the clip."""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import blake2b

import numpy as np

from anim.arrays import Bools, Floats
from anim.gltf.validation.buffer_layout import COMPONENT_SIZES
from anim.model import FLOAT32, Interpolation, TimeAxis, Track
from anim.optimization.tracks.key_reduction import INT16, are_exact_in_int16
from anim.optimization.tracks.quantization import ByteCosts

MAX_STACKED_VALUES = 1 << 20  # of tracks on one time axis, reduced at a time


def min_lossless_bytes(tracks: Sequence[Track], stays: Sequence[bool], costs: ByteCosts) -> float:
    """Return bytes that `key_reduction.reduce_lossless` of all tracks takes at least.

    stays: whether each track is written even if it is constant; other constants count nothing. Tracks on one time axis
    are reduced together; equal values, and equal key times, count once. Pointers count nothing: they have a bound of
    their own.
    """
    groups: dict[tuple[TimeAxis, Interpolation, int], list[tuple[Track, bool]]] = {}
    for track, stay in zip(tracks, stays, strict=True):
        if track.node is not None:
            key = track.time_axis, track.interpolation, track.values.shape[1]
            groups.setdefault(key, []).append((track, stay))
    sizes: dict[tuple[int, bytes], int] = {}
    axes: dict[bytes, float] = {}
    text = 0.0
    for (axis, interpolation, width), group in groups.items():
        count = max(MAX_STACKED_VALUES // (len(axis) * width), 1)
        for some in (group[first : first + count] for first in range(0, len(group), count)):
            values = np.array([track.values for track, _ in some])
            is_constant, kept = _retained_keys(values, interpolation)
            fits = are_exact_in_int16(values) & (interpolation is not Interpolation.CUBICSPLINE)
            for (track, stay), constant, mask, fit in zip(some, is_constant.tolist(), kept, fits.tolist(), strict=True):
                if constant:
                    text += costs.single_key * stay
                    continue
                slim, parts = track.values[mask], 3 if interpolation is Interpolation.CUBICSPLINE else 1
                storage = INT16 if fit and track.path == "rotation" and track.storage == FLOAT32 else track.storage
                component = COMPONENT_SIZES[storage.component_type]
                text += costs.track
                sizes[component, _digest(slim)] = parts * component * slim.size
                times = axis.times[mask]
                axes[_digest(times)] = costs.axis + 4 * len(times)
    return text + sum(sizes.values()) + sum(axes.values())


def _digest(values: Floats) -> bytes:
    return blake2b(values.data, digest_size=16).digest()


def _retained_keys(values: Floats, interpolation: Interpolation) -> tuple[Bools, Bools]:
    """Masks of the constant ones of G tracks (G, K, C), and (G, K) of the keys after the reduction of the others."""
    same = (values[:, 1:] == values[:, :-1]).all(axis=2)  # equal to the previous key
    first = np.ones((len(values), 1), np.bool_)
    if interpolation is Interpolation.STEP:
        kept = np.hstack((first, ~same))
    elif interpolation is Interpolation.CUBICSPLINE:
        kept = np.ones(values.shape[:2], np.bool_)
    else:
        kept = ~(np.hstack((first, same)) & np.hstack((same, first)))
    return same.all(axis=1), kept
