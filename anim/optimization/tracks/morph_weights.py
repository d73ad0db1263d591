"""Morph weights in fewer keys and bits, within a bound on the displacement of any vertex."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from anim.arrays import Floats
from anim.curves.fitting.key_reduction import greedy_indices
from anim.measure.error.surface import Surface
from anim.model import AccessorFormat, Interpolation, Track
from anim.optimization.options import Packing
from anim.optimization.tracks import quantization
from anim.optimization.tracks.quantization import EncodedKeys
from anim.sampling.track import sample

KEY_BUDGET_FRACTION = 0.6  # of the bound, for key reduction
QUANTIZATION_BUDGET_FRACTION = 0.35  # of the bound, for storage
MAX_PLAIN_KEYS = 8  # up to here integers are no larger than meshopt's filter, with 4 bytes per weight
INTEGER_FORMATS = (AccessorFormat(5121, normalized=True), AccessorFormat(5123, normalized=True))
MAX_INTEGERS = {5121: 255.0, 5123: 65535.0}


def influence_radius(surfaces: Sequence[Surface], node: int, widening: float) -> Floats:
    """Return the displacement (M, V), m, of each vertex by each morph target of a node at weight 1.

    Vertices without displacement are left out. widening: largest world length of one unit of the mesh's space.
    """
    moved = [np.sqrt((part.targets**2).sum(axis=-1)) for part in surfaces if part.owner == node and len(part.targets)]
    if not moved:
        return np.zeros((0, 0))
    every = np.concatenate(moved, axis=1)
    return widening * every[:, every.max(axis=0) > 0]


def bound_still_weights(track: Track, reach: Floats, bound: float, fraction: float) -> Floats:
    """Return the reach (M, V + U) with a vertex for each of U weights that move none, as targets of normals only.

    Their error, as a `fraction` of each one's range, is then a displacement by `bound`, m. Both are above 0.
    """
    still = np.flatnonzero(~reach.any(axis=1))
    values = sample(track, track.times)[:, still]
    ranges = np.where(np.ptp(values, axis=0) > 0, np.ptp(values, axis=0), np.abs(values).max(axis=0))
    added = np.zeros((len(reach), len(still)))
    added[still, np.arange(len(still))] = bound / (fraction * np.where(ranges > 0, ranges, 1.0))
    return np.concatenate([reach, added], axis=1)


def weight_error(track: Track, weights: Floats, reach: Floats) -> float:
    """Return the largest displacement, m, between constant weights (M,) and the track, at its keys."""
    return _displacement(sample(track, track.times) - weights, reach)


def reduce_weights(
    track: Track, reach: Floats, bound: float, grid: Floats, packing: Packing
) -> tuple[Track, EncodedKeys, float]:
    """Return the weights in fewer keys, their encoding, and the largest displacement in metres.

    grid: (K,) s, possible key times, for splines finer than their keys. Splines become linear.
    """
    values = sample(track, grid)
    keep = greedy_indices(len(grid), partial(_is_straight, values, grid, reach, KEY_BUDGET_FRACTION * bound))
    keys, times = values[keep], grid[keep]
    if np.ptp(keys, axis=0).max(initial=0.0) == 0:
        keys, times = keys[:1], times[:1]
    keys, storage, stored = _encode_weights(keys, reach, QUANTIZATION_BUDGET_FRACTION * bound, packing)
    storage = storage._replace(element="SCALAR")  # of pointers too, where the path does not imply it
    new = replace(track.with_keys(times, keys, interpolation=Interpolation.LINEAR), storage=storage)
    return new, stored, _displacement(sample(new, grid) - values, reach)


def _is_straight(values: Floats, grid: Floats, reach: Floats, bound: float, start: int, end: int) -> bool:
    inner = slice(start + 1, end)
    u = ((grid[inner] - grid[start]) / (grid[end] - grid[start]))[:, None]
    return _displacement(values[start] + u * (values[end] - values[start]) - values[inner], reach) <= bound


def _displacement(difference: Floats, reach: Floats) -> float:
    """Largest displacement of any vertex by differences of weights (F, M)."""
    return float((np.abs(difference) @ reach).max(initial=0.0))


def _encode_weights(
    keys: Floats, reach: Floats, bound: float, packing: Packing
) -> tuple[Floats, AccessorFormat, EncodedKeys]:
    largest = float(reach.sum(axis=0).max(initial=0.0))  # m, for an error of 1 in all weights
    if packing is Packing.CORE or len(keys) <= MAX_PLAIN_KEYS:
        for form in INTEGER_FORMATS:
            scale = MAX_INTEGERS[form.component_type]
            if keys.min() >= 0 and keys.max() <= 1 and largest / (2 * scale) <= bound:
                rounded = np.rint(keys * scale) / scale
                return rounded, form, EncodedKeys(rounded, "integers")
        exact = keys.astype(np.float32).astype(np.float64)
        return exact, AccessorFormat(), EncodedKeys(exact, "float32")
    found = quantization.encode(keys, quantization.choose_format(keys, "weights", bound / max(largest, 1e-30), packing))
    return found.values, AccessorFormat(), found
