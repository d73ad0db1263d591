"""Morph targets and their weights as stored: all weights within 0…1, values rounded.

glTF allows any weight, but Blender clamps them to 0…1 (its importer widens a slider by the first key alone), Unity does
too, and viewers compute bounding boxes for weights of 0…1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from anim.arrays import AnyArray, Floats, Ints

MAX_INT16 = 32767


@dataclass(frozen=True, slots=True)
class MorphEncoding:
    """An encoding of all frames: frame f is scale · (base + Σ weights[f] targets).

    base: (V, 3). targets: (M, V, 3) float32. frames: (K,) with a key. weights: (K, M). scale: m per unit.
    """

    kind: str
    base: AnyArray
    targets: AnyArray
    frames: Ints
    weights: Floats
    scale: float = 1.0

    def size(self, *, quantize: bool) -> int:
        """Bytes of the accessor data in a file."""
        return self.targets.size // 3 * (8 if quantize else 12) + 4 * self.weights.size + 4 * len(self.frames)


def encode_morphs(form: MorphEncoding, *, quantize: bool) -> MorphEncoding:
    """Return the encoding as stored: the same motion with every weight in 0…1, all rounded to float32.

    quantize: targets become multiples of 1 / 32767 within ±1, each by its own factor, with the inverse in its weights;
    the encoding gets a scale if a target moves a vertex by more than 1 m.
    The mean rounding error is added to the base, so that shifting it to positive weights adds no error.
    (weights −1, 3 of target t) → weights 0, 1 of 4 t, and base − t
    """
    changed = _to_unit_range(form)
    if quantize:
        changed = _quantize(changed)
    weights = changed.weights.astype(np.float32).astype(np.float64)
    changed = replace(changed, weights=weights)
    if form.kind == "keyframes":  # the base is exactly a frame
        base = form.base.astype(np.float64)
    else:
        base = form.base + _mean_offset(form) - changed.scale * _mean_offset(changed)
    return replace(changed, base=(base / changed.scale).astype(np.float32))


def _to_unit_range(form: MorphEncoding) -> MorphEncoding:
    """The encoding with each target's weights from 0 to 1, before its base is shifted.

    The end of a weight's range nearer to 0 becomes 0 (the target is negated if that is the upper end), so that the base
    remains as near as possible to its shape.
    """
    low, high = form.weights.min(axis=0), form.weights.max(axis=0)
    is_low = np.abs(low) <= np.abs(high)
    start, end = np.where(is_low, low, high), np.where(is_low, high, low)
    used = start != end
    start, span = start[used], (end - start)[used]
    targets = form.targets[used] * span.astype(np.float32)[:, None, None]
    return replace(form, targets=targets, weights=np.abs(form.weights[:, used] - start) / np.abs(span))


def _quantize(form: MorphEncoding) -> MorphEncoding:
    size = np.abs(form.targets).max(axis=(1, 2), initial=0.0).astype(np.float64)
    size = np.where(size > 0, size, 1.0)
    scale = 2.0 ** np.ceil(np.log2(size.max(initial=1.0)))  # a power of two, which adds no rounding
    targets = (np.rint(form.targets / size[:, None, None] * MAX_INT16) / MAX_INT16).astype(np.float32)
    return replace(form, targets=targets, weights=form.weights * (size / scale), scale=float(scale))


def _mean_offset(form: MorphEncoding) -> Floats:
    """Mean displacement by the targets (V, 3) over all keys, in units of the encoding."""
    total = np.zeros(form.base.shape)
    for target, weight in zip(form.targets, form.weights.mean(axis=0), strict=True):
        total += weight * target
    return total


def fit_directions(normals: AnyArray | None, form: MorphEncoding) -> AnyArray | None:
    """Return normals or tangents (1 + M, V, 3) of the base, unit, and of each target: a least-squares fit.

    normals: (F, V, 3), or None.
    """
    if normals is None:
        return None
    kept = normals[form.frames].astype(np.float64)
    design = np.concatenate((np.ones((len(kept), 1)), form.weights), axis=1)
    rcond = np.finfo(np.float64).eps * max(design.shape)
    found = np.linalg.pinv(design, rcond) @ kept.reshape(len(kept), -1)  # equals lstsq, a hundred times faster
    solved: AnyArray = found.reshape(-1, *normals.shape[1:])
    length = np.maximum(np.linalg.norm(solved[0], axis=1, keepdims=True), 1e-3)
    solved /= length  # a base normal must be unit; scaling all normals of a vertex keeps their directions
    up = np.where(np.abs(np.linalg.norm(solved[0], axis=1, keepdims=True) - 1) < 1e-6, solved[0], (0.0, 1.0, 0.0))
    solved[0] = up
    return solved
