"""Error of a stage: the distance of its vertices, as usd-core skins them, from those of the source."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.errors import DataRangeError
from anim.exchange.usd_skel.sample_times import add_times
from anim.exchange.usd_skel.stage_points import StagePoints
from anim.model import Clip, Scene
from anim.skinning.bake import prepare_bake

MIN_INTERVAL_S = 1e-5  # s; shorter ones are jumps, during which there is no right vertex
MAX_TIMES = 2000  # measured ones: of longer clips some, evenly


class StageError(NamedTuple):
    """Largest distance (m) of a vertex of the stage from the source, and its time (s)."""

    distance: float
    time: float


def stage_error(
    stage: Any, prims: Mapping[int, Any], scene: Scene, clip: Clip, times: Floats, codes: Sequence[float]
) -> StageError:
    """Return the largest error at `times` (F,) s, whose time codes have samples, at all keys, and half-way between.

    prims: the Mesh prim of each instance, by node. Raises DataRangeError where a vertex of the stage is not finite.
    """
    if not prims:
        return StageError(0.0, float(times[0]))
    baker = prepare_bake(scene, rigid=True, nodes=list(prims))
    measured = _measured_times(add_times(times, clip.key_times))
    code_of = dict(zip(times.tolist(), codes, strict=True))
    rate, most = float(stage.GetTimeCodesPerSecond()), StageError(0.0, float(times[0]))
    points = StagePoints(stage, [prims[each.node] for each in baker.instances])
    for chunk in baker.bake(clip, times=measured).chunks():
        for i, expected in enumerate(chunk.positions):
            time = float(measured[chunk.first + i])
            distance = _distance(points.at(code_of.get(time, time * rate)), expected)
            if not math.isfinite(distance):  # NaN would be less than any error
                raise DataRangeError(f"vertices are not finite at {time:g} s as USD skins them")
            most = max(most, StageError(distance, time))
    return most


def _measured_times(times: Floats) -> Floats:
    width = np.diff(times)
    middle = (times[:-1] + width / 2)[width > MIN_INTERVAL_S]
    found = np.unique(np.concatenate((times, middle)))
    chosen: Floats = found[np.unique(np.linspace(0, len(found) - 1, MAX_TIMES).round().astype(int))]
    return chosen


def _distance(found: Floats, expected: Floats) -> float:
    difference = np.subtract(found, expected, dtype=np.float64)  # squares of 1e20 m are beyond float32
    return float(np.sqrt((difference * difference).sum(axis=1).max(initial=0.0)))
