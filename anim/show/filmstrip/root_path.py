"""Root path of a figure on the ground, for a camera that follows it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.model import VertexCache

MIN_PATH_PER_DIAGONAL = 1.0  # diagonals of the figure; a static camera covers shorter paths
SMOOTHING_FRAMES = 5  # frames before and after in the running mean, so that the camera doesn't sway with each step


@dataclass(frozen=True, slots=True)
class RootPath:
    """Root path. times: (P,) s. places: (P, 2) m of x and z, relative to its start (2,)."""

    times: Floats
    places: Floats
    start: Floats

    def at(self, times: float | Floats) -> Floats:
        """Return the positions (..., 2) m at times (...) s."""
        return np.stack([np.interp(times, self.times, self.places[:, i]) for i in (0, 1)], axis=-1)

    def distance(self, times: float | Floats) -> Floats:
        """Return the arc length (...) m of the path at times (...) s."""
        return np.asarray(np.interp(times, self.times, self._distances()))

    def milestones(self, time: float, spacing: float) -> Floats:
        """Return the positions (M, 2), m in x and z, every `spacing` m along the path up to `time`."""
        along = np.arange(0, float(self.distance(time)) + 1e-9, spacing)
        distances = self._distances()
        places = np.stack([np.interp(along, distances, self.places[:, i]) for i in (0, 1)], axis=-1)
        return np.asarray(self.start + places)

    def _distances(self) -> Floats:
        steps = np.linalg.norm(np.diff(self.places, axis=0), axis=1)
        return np.concatenate(([0.0], np.cumsum(steps)))


def travels(cache: VertexCache) -> bool:
    """Return whether a figure travels from its start by more than its own size."""
    return _extent(_centers(cache)) > MIN_PATH_PER_DIAGONAL * _size(cache)


def root_path(cache: VertexCache) -> RootPath:
    """Return the path of the mean of all vertices on the ground, smoothed over steps."""
    centers = _centers(cache)
    smooth = _smooth(centers)
    return RootPath(cache.times, smooth - smooth[0], smooth[0])


def _centers(cache: VertexCache) -> Floats:
    """Mean of all vertices (P, 2), x and z."""
    means = [chunk.positions[..., [0, 2]].mean(axis=1, dtype=np.float64) for chunk in cache.chunks()]
    return np.concatenate(means)


def _size(cache: VertexCache) -> float:
    """Diagonal of the figure in m, the median over all frames."""
    corners = [np.ptp(chunk.positions, axis=1).astype(np.float64) for chunk in cache.chunks()]
    return float(np.median(np.linalg.norm(np.concatenate(corners), axis=1)))


def _extent(places: Floats) -> float:
    return float(np.linalg.norm(np.ptp(places, axis=0)))


def _smooth(places: Floats) -> Floats:
    """Running mean (P, 2) that preserves both ends and straight lines."""
    half = min(SMOOTHING_FRAMES, len(places) - 1)
    before, after = 2 * places[0] - places[half:0:-1], 2 * places[-1] - places[-2 : -half - 2 : -1]
    padded = np.concatenate((before, places, after))
    total = np.cumsum(np.concatenate((np.zeros((1, 2)), padded)), axis=0)
    size = 2 * half + 1
    return np.asarray((total[size:] - total[:-size]) / size)
