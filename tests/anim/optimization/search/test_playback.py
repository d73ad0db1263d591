"""What players show between keys, against scipy's Slerp and against formulas one key at a time."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from anim.arrays import Floats
from anim.maths import quaternion
from anim.optimization.search import playback
from anim.optimization.search.playback import level_world_matrices, required_levels
from anim.sampling import sample_pose, world_matrices
from anim.sampling.track import find_interval
from tests.anim.optimization.making import scene, waving
from tests.clips import about, skeleton

RNG = np.random.default_rng(11)
KEYS = np.array([0.0, 0.3, 0.35, 1.5, 4.0])
AT = np.sort(np.concatenate((KEYS, RNG.uniform(-0.5, 5, 200))))


def _turns(tracks: int) -> Floats:
    return quaternion.normalize(RNG.normal(size=(len(KEYS), tracks, 4)))


def _as_three(a: Floats, b: Floats, u: float) -> Floats:
    """three.js, Quaternion.slerpFlat, without its short cut for near keys: the sines of what acos makes of the dot."""
    b = -b if a @ b < 0 else b
    theta = math.acos(min(float(a @ b), 1.0))
    return np.asarray((math.sin((1 - u) * theta) * a + math.sin(u * theta) * b) / math.sin(theta))


def test_arcs_are_scipys_slerp() -> None:
    keys = _turns(7)
    shown = playback.slerp_raw(keys, find_interval(KEYS, AT))
    for g in range(7):
        expected = Slerp(KEYS, Rotation.from_quat(keys[:, g]))(np.clip(AT, KEYS[0], KEYS[-1]))
        assert (Rotation.from_quat(shown[:, g]) * expected.inv()).magnitude().max() < 1e-7
    assert np.linalg.norm(shown, axis=2) == pytest.approx(np.ones((len(AT), 7)), abs=1e-12)


def test_arcs_of_keys_that_are_not_of_unit_length() -> None:
    """int16 leaves keys too long or too short by some 1e-5; nothing normalizes them on the way."""
    keys = np.rint(_turns(40) * 32767) / 32767
    place = find_interval(KEYS, AT)
    shown = playback.slerp_raw(keys, place)
    for f, (left, right, u) in enumerate(zip(place.left, place.right, place.u, strict=True)):
        for g in range(40):
            expected = _as_three(keys[left, g], keys[right, g], u) if u else keys[left, g]
            off = shown[f, g] - math.copysign(1, expected @ shown[f, g]) * expected
            assert np.linalg.norm(off) < 1e-5  # where lengths are off by up to 3e-5
    at_keys = playback.slerp_raw(keys, find_interval(KEYS, KEYS))
    assert np.minimum(np.abs(at_keys - keys).max(axis=2), np.abs(at_keys + keys).max(axis=2)).max() < 1e-15


@pytest.mark.parametrize("degrees", [1e-6, 1, 90, 179, 179.999, 180])
def test_steps_of_any_size_turn_evenly(degrees: float) -> None:
    keys = about("y", [10, 10 + degrees])[:, None]
    shown = playback.slerp_raw(keys, find_interval(np.array([0.0, 1.0]), np.linspace(0, 1, 9)))[:, 0]
    assert np.isfinite(shown).all()
    turned = np.degrees(np.unwrap(2 * np.arctan2(shown[:, 1], shown[:, 3]))) - 10
    way = -1 if degrees == 180 and turned[1] < 0 else 1  # half a turn has two shortest ways
    assert turned == pytest.approx(way * degrees * np.linspace(0, 1, 9), abs=1e-5)


def test_equal_keys_stay_as_they_are_stored() -> None:
    keys = np.tile([0.1, 0.2, 0.3, 0.9], (3, 1, 1)).reshape(3, 1, 4)
    shown = playback.slerp_raw(keys, find_interval(np.arange(3.0), np.linspace(0, 2, 11)))
    assert shown == pytest.approx(np.broadcast_to(keys[0], shown.shape), abs=1e-15)


def test_chords_are_mixed_by_components_then_normalized() -> None:
    keys = _turns(5) * RNG.uniform(0.98, 1.02, (len(KEYS), 5, 1))
    place = find_interval(KEYS, AT)
    shown = playback.nlerp(keys, place)
    for f, (left, right, u) in enumerate(zip(place.left, place.right, place.u, strict=True)):
        for g in range(5):
            a, b = keys[left, g], keys[right, g]
            mix = (1 - u) * a + u * (b if a @ b >= 0 else -b)
            assert shown[f, g] == pytest.approx(mix / math.sqrt(mix @ mix), abs=1e-12)


def test_lines_are_numpys() -> None:
    keys = RNG.normal(size=(len(KEYS), 3, 3))
    shown = playback.linear_error(keys, find_interval(KEYS, AT))
    for g in range(3):
        for c in range(3):
            assert shown[:, g, c] == pytest.approx(np.interp(AT, KEYS, keys[:, g, c]), abs=1e-12)


@pytest.mark.parametrize("degrees", [20, 60, 90])
def test_how_far_chord_and_arc_are_apart(degrees: float) -> None:
    keys = about("x", [0, degrees])[:, None]
    place = find_interval(np.array([0.0, 1.0]), np.linspace(0, 1, 2001))
    arcs, chords = playback.slerp_raw(keys, place), playback.nlerp(keys, place)
    apart = (Rotation.from_quat(arcs[:, 0]) * Rotation.from_quat(chords[:, 0]).inv()).magnitude().max()
    assert float(playback.arc_distance(np.radians(degrees))) == pytest.approx(apart, rel=0.04)


def test_steps_are_the_turns_from_key_to_key() -> None:
    keys = _turns(3)
    found = playback.steps(keys)
    for g in range(3):
        turns = Rotation.from_quat(keys[:, g])
        assert found[:, g] == pytest.approx((turns[1:] * turns[:-1].inv()).magnitude(), abs=1e-7)


def test_worlds_are_those_of_poses() -> None:
    of, at = scene(), np.linspace(0, 2, 9)
    shown = sample_pose(of.skeleton, waving(), at)
    local = [np.swapaxes(part, 0, 1) for part in (shown.translation, shown.rotation, shown.scale)]
    found = level_world_matrices(of.skeleton, local, of.skeleton.levels())
    assert found == pytest.approx(np.swapaxes(world_matrices(of.skeleton, shown), 0, 1), abs=1e-12)


def test_only_ancestors_are_needed() -> None:
    # 0 ─ 1 ─ 2,  1 ─ 3,  4
    tree = skeleton([-1, 0, 1, 1, -1])
    assert [level.tolist() for level in required_levels(tree, np.array([3]))] == [[0], [1], [3]]
    assert required_levels(tree, np.array([4]))[0].tolist() == [4]


def test_many_times_are_played_in_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    keys, place = _turns(3), find_interval(KEYS, AT)
    whole = playback.slerp_raw(keys, place)
    monkeypatch.setattr(playback, "MAX_MIXED_VALUES", 50)
    np.testing.assert_array_equal(playback.slerp_raw(keys, place), whole)
