"""Distances between corresponding vertices of two motions, frame by frame."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from anim.arrays import AnyArray, Floats
from anim.errors import ShapeError

MAX_SAMPLES = 16_000_000  # maximum number of vertices × frames for p99


@dataclass(frozen=True, slots=True)
class VertexDistance:
    """Distances in m. max_error at vertex and time (s); mean over all vertices and frames, p99 over up to MAX_SAMPLES.

    diagonal: size of the first model. frames: number of compared times. times, errors: of each frame (s), the largest
    distance.
    """

    max_error: float
    time: float
    vertex: int
    mean: float
    p99: float
    diagonal: float
    frames: int
    times: tuple[float, ...] = ()
    errors: tuple[float, ...] = ()


def vertex_distance(
    times: Floats, old: Iterable[AnyArray], new: Iterable[AnyArray], *, diagonal: float
) -> VertexDistance:
    """Return the distances of frames (V, 3) of two motions at `times` (F,). Raises ShapeError for other vertex counts.

    The frames are read once, one at a time. diagonal: m, of the first model's rest pose.
    """
    worst, time, vertex, total, count = 0.0, float(times[0]), -1, 0.0, 0
    samples: list[AnyArray] = []
    errors: list[float] = []
    for at, first, second in zip(times.tolist(), old, new, strict=True):
        if first.shape != second.shape:
            raise ShapeError(f"{len(first)} vertices and {len(second)} (expected the same)")
        distance = np.linalg.norm(first.astype(np.float64) - second, axis=1)
        far = int(distance.argmax())
        errors.append(float(distance[far]))
        if distance[far] > worst:
            worst, time, vertex = float(distance[far]), at, far
        total, count = total + float(distance.sum()), count + len(distance)
        step = max(1, len(times) * len(distance) // MAX_SAMPLES)
        samples.append(distance[::step].astype(np.float32))
    p99 = float(np.percentile(np.concatenate(samples), 99)) if samples else 0.0
    curve = tuple(times.tolist()), tuple(errors)
    return VertexDistance(worst, time, vertex, total / max(count, 1), min(p99, worst), diagonal, len(samples), *curve)
