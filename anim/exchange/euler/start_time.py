"""Shift of negative key times, valid in DCC scenes but not in glTF."""

from __future__ import annotations

from collections.abc import Iterable


def shift_to_zero(times: Iterable[float]) -> tuple[float, tuple[str, ...]]:
    """Return the shift in seconds of all keys to times ≥ 0, and a note if it is not 0.

    shift_to_zero([-0.5, 0, 1]) → 0.5, ("the first key is at -0.5 s: all are moved by 0.5 s, to begin at 0",)
    """
    first = min(times, default=0.0)
    if first >= 0:
        return 0.0, ()
    return -first, (f"the first key is at {first:.6g} s: all are moved by {-first:.6g} s, to begin at 0",)
