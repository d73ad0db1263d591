"""TimeAxis: the key times of tracks."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from anim import arrays
from anim.arrays import Floats


@dataclass(frozen=True, slots=True, eq=False, init=False)
class TimeAxis:
    """Key times in seconds, checked once and shared by tracks.

    times: (K,) finite, ≥ 0, strictly increasing, K ≥ 1; read-only.
    Axes compare by identity: tracks with one axis are keyed together, as on one input accessor of a file.
    Raises ShapeError, or RangeError with the index of the first invalid key.
    TimeAxis([0, 0.5, 2]) → an axis of 3 keys
    """

    times: Floats

    def __init__(self, times: ArrayLike) -> None:
        object.__setattr__(self, "times", arrays.as_key_times(times))

    def __reduce__(self) -> tuple[Any, ...]:
        return arrays.reduce_fields(self)

    def __len__(self) -> int:
        return len(self.times)

    def __repr__(self) -> str:
        return f"TimeAxis(keys={len(self)}, start_s={self.times[0]:.6g}, end_s={self.times[-1]:.6g})"


def as_time_axis(times: TimeAxis | ArrayLike) -> TimeAxis:
    """Return `times` itself if it is an axis, else an axis of these times."""
    return times if isinstance(times, TimeAxis) else TimeAxis(times)


def merge_times(axes: Iterable[TimeAxis]) -> Floats:
    """Return the distinct times of all axes, increasing; (0,) without axes."""
    times = [axis.times for axis in dict.fromkeys(axes)]
    if len(times) == 1:
        return times[0]
    return arrays.unique_sorted(np.concatenate(times)) if times else np.zeros(0)
