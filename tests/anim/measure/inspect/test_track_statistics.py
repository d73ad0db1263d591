"""What keys tell about tracks: by hand, and all tracks at once against a plain loop over keys with scipy's slerp."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from anim.measure.inspect import track_statistics
from anim.measure.inspect.track_statistics import TrackStats, stats
from anim.model import AccessorFormat, Skeleton, Track
from anim.sampling import batch as module
from anim.sampling.batch import concatenate
from tests import clips
from tests.clips import CUBICSPLINE, STEP

NODE = clips.skeleton([-1], translation=[[1, 2, 3]])


def of(*tracks: Track, skeleton: Skeleton = NODE) -> TrackStats:
    return stats(concatenate(tracks), skeleton)


def test_still_tracks_and_those_that_only_rest() -> None:
    rest, away = [[1, 2, 3]] * 3, [[0, 0, 0]] * 3
    found = of(
        clips.track("translation", [0, 1, 2], rest),
        clips.track("translation", [0, 1, 2], away),
        clips.track("translation", [0, 1, 2], [*away[:2], [1, 0, 0]]),
        clips.track("rotation", [0, 1], [[0, 0, 0, 1], [0, 0, 0, -1]]),
    )
    assert found.constant.tolist() == [True, True, False, True]
    assert found.no_effect.tolist() == [True, False, False, True]
    assert found.redundant.tolist() == [2, 2, 0, 1]
    assert found.flips.tolist() == [0, 0, 0, 1]


def test_no_tracks_have_no_facts() -> None:
    assert len(of().redundant) == 0


def test_tangents_move_a_track_whose_values_stand() -> None:
    values, still = np.ones((2, 3)), np.zeros((2, 3))
    inner, outer = np.array([[0, 0, 0], [1, 0, 0]]), np.array([[1, 0, 0], [0, 0, 0]])  # at the second key, at the first
    found = of(
        clips.track("scale", [0, 1], values, CUBICSPLINE, tangents=(still, still)),
        clips.track("scale", [0, 1], values, CUBICSPLINE, tangents=(inner, still)),
        clips.track("scale", [0, 1], values, CUBICSPLINE, tangents=(outer, inner)),  # those are never played
    )
    assert found.constant.tolist() == [True, False, True]


def test_rotations_off_unit_wide_or_with_other_signs() -> None:
    turns = clips.about("x", [0, 175, 10]) * np.array([[1], [1.01], [-1]])
    found = of(clips.track("rotation", [0, 1, 2], turns), clips.track("rotation", [0, 1], clips.about("y", [0, 30])))
    assert found.non_unit.tolist() == [1, 0]
    assert found.wide.tolist() == [1, 0]
    assert found.flips.tolist() == [1, 0]
    assert found.widest == pytest.approx(np.radians([175, 30]))


def test_keys_that_their_neighbors_give() -> None:
    line = clips.track("translation", [0, 1, 3, 4], np.outer([0, 1, 3, 3.5], [1, 0, 0]))
    steps = clips.track("translation", [0, 1, 2, 3], [[0, 0, 0], [0, 0, 0], [1, 0, 0], [1, 0, 0]], STEP)
    t = np.array([0.0, 0.3, 1.0])
    cubic = np.stack((t**3, -(t**2), t), axis=1)
    slopes = np.stack((3 * t**2, -2 * t, np.ones(3)), axis=1)
    bent = slopes.copy()
    bent[1, 0] += 0.1
    found = of(
        line,
        steps,
        clips.track("translation", t, cubic, CUBICSPLINE, tangents=(slopes, slopes)),
        clips.track("translation", t, cubic, CUBICSPLINE, tangents=(slopes, bent)),
    )
    assert found.redundant.tolist() == [1, 1, 1, 0]


def test_a_still_spline_keeps_two_keys() -> None:
    values, still = np.ones((3, 3)), np.zeros((3, 3))
    assert of(clips.track("scale", [0, 1, 2], values, CUBICSPLINE, tangents=(still, still))).redundant.tolist() == [1]


def test_a_key_that_leads_the_way_through_a_half_turn_is_needed() -> None:
    """From 0° straight to 180° there is no shorter way."""
    found = of(
        clips.track("rotation", [0, 1, 2], clips.about("x", [0, 90, 180])),
        clips.track("rotation", [0, 1, 2], clips.about("x", [0, 80, 160])),
    )
    assert found.redundant.tolist() == [0, 1]


def test_a_quaternion_of_another_length_is_needed() -> None:
    """Players that don't normalize show it; rounding to integers is no such length."""
    turns = clips.about("x", [0, 30, 60])
    rounded = replace(
        clips.track("rotation", [0, 1, 2], turns * [[1], [1 + 1e-5], [1]]), storage=AccessorFormat(5122, True)
    )
    found = of(
        clips.track("rotation", [0, 1, 2], turns * [[1], [1 + 1e-5], [1]]),
        clips.track("rotation", [0, 1, 2], turns * 1.01),
        rounded,
    )
    assert found.redundant.tolist() == [0, 1, 1]


@pytest.mark.parametrize("limit", [1, 4096])
def test_many_rotations_against_a_loop(limit: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_GROUP_KEYS", limit)
    monkeypatch.setattr(track_statistics, "BLOCK_KEYS", limit)
    rng = np.random.default_rng(5)
    tracks = [_turning(rng, int(keys)) for keys in rng.integers(1, 12, 20)]
    found = of(*tracks)
    for i, track in enumerate(tracks):
        q = track.values
        steps = [np.abs(a @ b) for a, b in pairwise(q)]
        assert found.widest[i] == pytest.approx(max((2 * np.arccos(min(s, 1)) for s in steps), default=0), abs=1e-6)
        assert found.flips[i] == sum(a @ b < 0 for a, b in pairwise(q))
        assert found.constant[i] == (len(q) == 1)
        assert found.redundant[i] == sum(_is_given(track, k) for k in range(1, len(q) - 1))


def _turning(rng: np.random.Generator, keys: int) -> Track:
    """Random turns of less than 90° with every other key, roughly, on the arc between its neighbors; any signs."""
    times = np.cumsum(rng.uniform(0.1, 1, keys))
    turns = Rotation.from_rotvec(np.cumsum(rng.normal(0, 0.3, (keys, 3)), axis=0))
    if keys > 2:
        anchors = np.unique([0, *np.flatnonzero(rng.random(keys) < 0.5), keys - 1])
        turns = Slerp(times[anchors], turns[anchors])(times)
    return clips.track("rotation", times, turns.as_quat() * rng.choice([-1.0, 1.0], (keys, 1)))


def _is_given(track: Track, k: int) -> bool:
    pair = [k - 1, k + 1]
    given = Slerp(track.times[pair], Rotation.from_quat(track.values[pair]))(track.times[k])
    return bool((given.inv() * Rotation.from_quat(track.values[k])).magnitude() < 1e-7)
