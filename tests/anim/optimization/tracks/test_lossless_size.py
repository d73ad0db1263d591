"""Lower bound of lossless clips: never above what the reduction gives."""

from __future__ import annotations

import numpy as np
import pytest

from anim.model import Clip, Interpolation, Track
from anim.model.track import share_time_axes
from anim.optimization.options import Objective, Packing
from anim.optimization.search.plan import Solution, value_bytes
from anim.optimization.tracks import lossless_size
from anim.optimization.tracks.key_reduction import reduce_lossless
from anim.optimization.tracks.lossless_size import min_lossless_bytes
from anim.optimization.tracks.quantization import BYTE_COSTS, EncodedKeys, Encoding

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
@pytest.mark.parametrize("stays", [True, False])
def test_no_lossless_clip_is_smaller(seed: int, stays: bool) -> None:
    tracks = _tracks(seed)
    slim = share_time_axes(reduce_lossless(track) for track in tracks)
    if not stays:
        slim = [track for track in slim if len(track.times) > 1]
    exact = Solution(Clip("", tuple(slim)), tuple(EncodedKeys(track.values, "as it is") for track in slim), ())
    assert min_lossless_bytes(tracks, [stays] * len(tracks), COSTS) <= exact.size(Encoding(Packing.CORE, COSTS))


def test_tracks_of_one_axis_are_counted_alike_in_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    tracks = [*_tracks(1), *_tracks(2)]
    whole = min_lossless_bytes(tracks, [True] * len(tracks), COSTS)
    monkeypatch.setattr(lossless_size, "MAX_STACKED_VALUES", 1)
    assert min_lossless_bytes(tracks, [True] * len(tracks), COSTS) == whole


def test_floats_that_all_differ_are_counted_whole() -> None:
    values = np.random.default_rng(1).normal(size=(12, 3))
    track, axis = Track(0, "translation", "LINEAR", TIMES, values), COSTS.axis + 4 * 12
    assert _bytes(track) == COSTS.track + 12 * 12 + axis
    assert _bytes(Track(None, "pointer", "LINEAR", TIMES, values, pointer="/a/0/b")) == 0
    turning = np.concatenate([values, np.ones((12, 1))], axis=1)
    assert _bytes(Track(0, "rotation", "LINEAR", TIMES, turning)) == COSTS.track + 12 * 16 + axis
    whole = np.tile(np.eye(4)[:2], (6, 1))
    assert _bytes(Track(0, "rotation", "LINEAR", TIMES, whole)) == COSTS.track + 12 * 8 + axis


def test_constants_count_where_they_stay() -> None:
    still = Track(0, "scale", "LINEAR", [0, 1], [[1, 1, 1]] * 2)
    assert _bytes(still) == 0
    assert _bytes(still, stays=True) == COSTS.single_key


def test_equal_values_count_once_after_the_reduction() -> None:
    early, late = ([[0, 0, 0]] * count + [[1, 1, 1]] * (4 - count) for count in (2, 1))
    some, other = (Track(0, "scale", "LINEAR", range(4), values) for values in (early, late))
    slim = [reduce_lossless(track) for track in (some, other)]
    assert (slim[0].values == slim[1].values).all()
    values = value_bytes(slim[0])
    axes = sum(COSTS.axis + 4 * len(track.times) for track in slim)
    assert min_lossless_bytes([some, other], [False, False], COSTS) == 2 * COSTS.track + values + axes


def _bytes(track: Track, *, stays: bool = False) -> float:
    return min_lossless_bytes([track], [stays], COSTS)
