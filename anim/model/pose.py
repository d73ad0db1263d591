"""Pose: local transforms of all nodes at some times."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from anim.arrays import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Local transforms of all nodes at F times, each in the parent's space.

    times: (F,) s. translation (F, N, 3) m, rotation (F, N, 4) unit xyzw, scale (F, N, 3).
    weights: by node index, morph weights (F, M), for nodes with animated weights.
    """

    times: Floats
    translation: Floats
    rotation: Floats
    scale: Floats
    weights: Mapping[int, Floats] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"Pose(frames={len(self.times)}, nodes={self.translation.shape[1]})"
