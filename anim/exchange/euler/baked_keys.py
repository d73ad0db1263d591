"""Detect baked curves (one key per frame), and convert key times to glTF's: float32, not negative."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from enum import StrEnum

import numpy as np

from anim.arrays import Floats, Ints
from anim.errors import FormatError
from anim.exchange.euler.curve import Curve, Mode
from anim.exchange.euler.motion import EulerMotion, EulerNode
from anim.model import TimeAxis

MIN_BAKED_KEYS_PER_S = 10.0  # keys per second
MIN_BAKED_KEYS = 4
STEP_TOLERANCE = 0.01  # fraction by which steps may differ


class KeyPlacement(StrEnum):
    """Placement of the keys in the output."""

    AUTO = "auto"
    GRID = "grid"
    ADAPTIVE = "adaptive"


def is_baked(motion: EulerMotion, node: EulerNode, keys: KeyPlacement) -> bool:
    """Return True if a node keeps the source's key times without added keys.

    AUTO: True for recordings: BVH, or linear curves on one even grid of ten keys a second or more.
    """
    if keys != KeyPlacement.AUTO:
        return keys == KeyPlacement.GRID
    if motion.sampled is not None:
        return motion.sampled
    curves = curves_of(node)
    if all(len(curve.values) < MIN_BAKED_KEYS for curve in curves):
        return False
    changing = [curve for curve in curves if not curve.is_constant]
    return bool(changing) and all(_is_dense(curve, changing[0]) for curve in changing)


def curves_of(node: EulerNode) -> list[Curve]:
    """Return all curves of a node."""
    return [c for c in (*node.rotation, *node.moves.values(), *node.scales.values()) if c is not None]


def shift_to_zero(times: Iterable[float]) -> tuple[float, tuple[str, ...]]:
    """Return the shift in seconds of all keys to times ≥ 0, and a note if it is not 0.

    shift_to_zero([-0.5, 0, 1]) → 0.5, ("the first key is at -0.5 s: all are moved by 0.5 s, to begin at 0",)
    """
    first = min(times, default=0.0)
    if first >= 0:
        return 0.0, ()
    return -first, (f"the first key is at {first:.6g} s: all are moved by {-first:.6g} s, to begin at 0",)


def move_times(times: Floats, later: float) -> Floats:
    """Return increasing times (K,) `later` seconds later. Raises FormatError for keys that fall together there."""
    moved = times + later
    for k in np.flatnonzero(np.diff(moved) <= 0)[:1] + 1:
        apart = f"keys {k - 1} and {k} are {times[k] - times[k - 1]:.3g} s apart"
        raise FormatError(f"{apart}, which float64 doesn't hold {later:.3g} s later, where the first key is at 0 s")
    return moved


class Float32Times:
    """Key times rounded to float32, once per time axis."""

    def __init__(self) -> None:
        self._found: dict[TimeAxis, tuple[TimeAxis, Ints]] = {}

    def node(self, node: EulerNode) -> EulerNode:
        """Return the node with the times of all its curves rounded."""
        return replace(
            node,
            rotation=tuple(None if curve is None else self._curve(curve) for curve in node.rotation),
            moves={axis: self._curve(curve) for axis, curve in node.moves.items()},
            scales={axis: self._curve(curve) for axis, curve in node.scales.items()},
        )

    def _curve(self, curve: Curve) -> Curve:
        found = self._found.get(curve.time_axis)
        if found is None:
            stored = curve.times.astype(np.float32).astype(np.float64)
            last: Ints = np.flatnonzero(np.append(np.diff(stored) > 0, True))  # of keys equal in float32
            found = self._found[curve.time_axis] = TimeAxis(stored[last]), last
        axis, kept = found
        if len(kept) == len(curve.times):
            return replace(curve, time_axis=axis)
        return curve.select_keys(kept, axis)


def _is_dense(curve: Curve, first: Curve) -> bool:
    if len(curve.times) < MIN_BAKED_KEYS or (curve.modes[:-1] != Mode.LINEAR).any():
        return False
    steps = np.diff(curve.times)
    even = np.ptp(steps) < STEP_TOLERANCE * steps.mean()
    return bool(even and steps.mean() <= 1.001 / MIN_BAKED_KEYS_PER_S and np.array_equal(curve.times, first.times))
