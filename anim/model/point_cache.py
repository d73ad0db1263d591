"""Points that are born and die, at frames."""

from __future__ import annotations

from dataclasses import dataclass

from anim.arrays import Floats, Ints


@dataclass(frozen=True, slots=True, eq=False)
class PointCache:
    """Points alive at each of F frames.

    times: (F,) s. offsets: (F + 1,), the points of frame f are rows offsets[f] … offsets[f + 1]. ids: (M,), each
    particle's own from birth to death, ascending in a frame. positions: (M, 3) m. velocities: (M, 3) m/s. ages: (M,) s.
    lifetimes: (M,) s. size: m, radius.
    """

    times: Floats
    offsets: Ints
    ids: Ints
    positions: Floats
    velocities: Floats
    ages: Floats
    lifetimes: Floats
    size: float
