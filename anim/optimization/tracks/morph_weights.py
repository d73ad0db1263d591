"""Morph weights in fewer keys and fewer bits: no vertex may leave its path by more than a given distance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from anim.arrays import Floats
from anim.measure.error.surface import Surface
from anim.model import AccessorFormat, Interpolation, Track
from anim.optimization.options import Packing
from anim.optimization.tracks import quantization
from anim.optimization.tracks.quantization import EncodedKeys
from anim.sampling.track import sample

KEY_BUDGET_FRACTION = 0.6  # share of the bound that leaving out keys may use
QUANTIZATION_BUDGET_FRACTION = 0.35  # share that storing may use
FEW = 8  # keys up to which meshopt's filter, 4 bytes a weight before its codec, is not better than integers
FORMS = (AccessorFormat(5121, normalized=True), AccessorFormat(5123, normalized=True))
LARGEST = {5121: 255.0, 5123: 65535.0}


def influence_radius(surfaces: Sequence[Surface], node: int, widening: float) -> Floats:
    """Return how far (M, V), in metres, each morph target of a node moves each vertex at weight 1; unmoved ones are
    left out. widening: how much larger the world is than the mesh's space, at most."""
    moved = [np.sqrt((part.targets**2).sum(axis=-1)) for part in surfaces if part.owner == node and len(part.targets)]
    if not moved:
        return np.zeros((0, 0))
    every = np.concatenate(moved, axis=1)
    return widening * every[:, every.max(axis=0) > 0]


def weight_error(track: Track, weights: Floats, reach: Floats) -> float:
    """Return how far, in metres, fixed weights (M,) put any vertex from where the track does, at most, at its keys."""
    return _interval_error(sample(track, track.times) - weights, reach)


def reduce_weights(
    track: Track, reach: Floats, bound: float, grid: Floats, packing: Packing
) -> tuple[Track, EncodedKeys, float]:
    """Return the weights in fewer keys, how they are stored, and by how much, in metres, a vertex is off at most.

    grid: (K,) s, where keys may lie; for splines finer than their keys. Splines become lines.
    """
    values = sample(track, grid)
    keep = _greedy_weight_keys(values, grid, reach, KEY_BUDGET_FRACTION * bound)
    keys, times = values[keep], grid[keep]
    if np.ptp(keys, axis=0).max(initial=0.0) == 0:
        keys, times = keys[:1], times[:1]
    keys, storage, stored = _stored(keys, reach, QUANTIZATION_BUDGET_FRACTION * bound, packing)
    new = replace(
        track,
        interpolation=Interpolation.LINEAR,
        times=times,
        values=keys,
        in_tangents=None,
        out_tangents=None,
        storage=storage,
    )
    return new, stored, _interval_error(sample(new, grid) - values, reach)


def _greedy_weight_keys(values: Floats, grid: Floats, reach: Floats, bound: float) -> Floats:
    """Numbers of the keys that greedy longest segments keep."""
    kept, start, last = [0], 0, len(grid) - 1
    while start < last:
        good, step = start + 1, 2
        while good < last and _straight(values, grid, reach, bound, start, min(good + step, last)):
            good, step = min(good + step, last), step * 2
        bad = min(good + step, last + 1)
        while bad - good > 1:
            middle = (good + bad) // 2
            if _straight(values, grid, reach, bound, start, middle):
                good = middle
            else:
                bad = middle
        kept.append(good)
        start = good
    return np.array(kept)


def _straight(values: Floats, grid: Floats, reach: Floats, bound: float, start: int, end: int) -> bool:
    inner = slice(start + 1, end)
    share = ((grid[inner] - grid[start]) / (grid[end] - grid[start]))[:, None]
    return _interval_error(values[start] + share * (values[end] - values[start]) - values[inner], reach) <= bound


def _interval_error(difference: Floats, reach: Floats) -> float:
    """How far weights that differ by (F, M) put any vertex from its place, at most."""
    return float((np.abs(difference) @ reach).max(initial=0.0))


def _stored(keys: Floats, reach: Floats, bound: float, packing: Packing) -> tuple[Floats, AccessorFormat, EncodedKeys]:
    largest = float(reach.sum(axis=0).max(initial=0.0))  # m, where all weights are off by 1
    if packing is Packing.CORE or len(keys) <= FEW:
        for form in FORMS:
            scale = LARGEST[form.component_type]
            if keys.min() >= 0 and keys.max() <= 1 and largest / (2 * scale) <= bound:
                rounded = np.rint(keys * scale) / scale
                return rounded, form, EncodedKeys(rounded, "integers")
        exact = keys.astype(np.float32).astype(np.float64)
        return exact, AccessorFormat(), EncodedKeys(exact, "float32")
    found = quantization.encode(keys, quantization.choose_format(keys, "weights", bound / max(largest, 1e-30), packing))
    return found.values, AccessorFormat(), found
