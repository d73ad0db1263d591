"""Lower bound of lossless clips: never above what the reduction gives."""

from __future__ import annotations

import numpy as np
import pytest

from anim.model import Interpolation, Track
from anim.optimization.options import Objective
from anim.optimization.search.plan import value_bytes
from anim.optimization.tracks.key_reduction import reduce_lossless
from anim.optimization.tracks.lossless_size import min_lossless_bytes
from anim.optimization.tracks.quantization import BYTE_COSTS

COSTS = BYTE_COSTS[Objective.FILE]
TIMES = np.arange(12) / 10


def _tracks(seed: int) -> list[Track]:
    """Tracks of every interpolation, with repeated values; some are constant, some rotations whole in int16."""
    generator = np.random.default_rng(seed)
    found = []
    for node, (path, width) in enumerate([("translation", 3), ("rotation", 4), ("scale", 3), ("rotation", 4)] * 3):
        interpolation = list(Interpolation)[int(generator.integers(3))]
        values = generator.integers(0, 2, (len(TIMES), width)) + (path == "rotation") * np.eye(width)[-1]
        if generator.random() < 0.2:
            values[:] = values[0]
        if generator.random() < 0.3 and path == "rotation":
            values = np.tile(np.eye(4)[:2], (6, 1))
        tangents = [np.zeros((len(TIMES), width)), np.full((len(TIMES), width), float(generator.integers(2)))]
        cubic = interpolation is Interpolation.CUBICSPLINE
        found.append(Track(node, path, interpolation, TIMES, values, *(tangents if cubic else ())))
    return found


@pytest.mark.parametrize("seed", range(20))
def test_no_lossless_clip_is_smaller(seed: int) -> None:
    tracks = _tracks(seed)
    slim = [reduce_lossless(track) for track in tracks]
    exact = sum(COSTS.track + value_bytes(track) for track in slim if len(track.times) > 1)
    assert min_lossless_bytes(tracks, COSTS) <= exact


def test_floats_that_all_differ_are_counted_whole() -> None:
    values = np.random.default_rng(1).normal(size=(12, 3))
    track = Track(0, "translation", "LINEAR", TIMES, values)
    assert min_lossless_bytes([track], COSTS) == COSTS.track + 12 * 12
    assert min_lossless_bytes([Track(None, "pointer", "LINEAR", TIMES, values, pointer="/a/0/b")], COSTS) == 0
    assert min_lossless_bytes([Track(0, "scale", "LINEAR", [0, 1], [[1, 1, 1]] * 2)], COSTS) == 0
