"""What players show between keys, against scipy's Slerp and against formulas one key at a time."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from anim.arrays import Floats, Ints
from anim.maths import quaternion
from anim.optimization.search import playback
from anim.optimization.search.playback import level_world_matrices, required_levels
from anim.sampling import sample_pose, world_matrices
from tests.anim.optimization.making import scene, waving
from tests.clips import about, skeleton

RNG = np.random.default_rng(11)
KEYS = np.array([0.0, 0.3, 0.35, 1.5, 4.0])
AT = np.sort(np.concatenate((KEYS, RNG.uniform(-0.5, 5, 200))))


def _turns(tracks: int) -> Floats:
    """Unit quaternions (4, T, K)."""
    return np.moveaxis(quaternion.normalize(RNG.normal(size=(tracks, len(KEYS), 4))), 2, 0)


def _place(keys: Floats, at: Floats, tracks: int) -> tuple[Ints, Floats]:
    """Left keys and parameters (T, W) of tracks with the same key times."""
    left = np.clip(np.searchsorted(keys, at, side="right") - 1, 0, max(len(keys) - 2, 0))
    u = np.zeros(len(at))
    if len(keys) > 1:
        u = np.clip((at - keys[left]) / (keys[left + 1] - keys[left]), 0, 1)
    return np.tile(left, (tracks, 1)), np.tile(u, (tracks, 1))


def _one(keys: Floats) -> Floats:
    """Keys (K, 4) as those of one track (4, 1, K)."""
    return np.asarray(keys.T[:, None])


def _as_three(a: Floats, b: Floats, u: float) -> Floats:
    """three.js, Quaternion.slerpFlat, without its short cut for near keys: the sines of what acos makes of the dot."""
    b = -b if a @ b < 0 else b
    theta = math.acos(min(float(a @ b), 1.0))
    return np.asarray((math.sin((1 - u) * theta) * a + math.sin(u * theta) * b) / math.sin(theta))


def test_arcs_are_scipys_slerp() -> None:
    keys = _turns(7)
    shown = playback.slerp_raw(keys, *_place(KEYS, AT, 7))
    for t in range(7):
        expected = Slerp(KEYS, Rotation.from_quat(keys[:, t].T))(np.clip(AT, KEYS[0], KEYS[-1]))
        assert (Rotation.from_quat(shown[:, t].T) * expected.inv()).magnitude().max() < 1e-7
    assert np.linalg.norm(shown, axis=0) == pytest.approx(np.ones((7, len(AT))), abs=1e-12)


def test_arcs_of_keys_that_are_not_of_unit_length() -> None:
    """int16 leaves keys too long or too short by some 1e-5; nothing normalizes them on the way."""
    keys = np.rint(_turns(40) * 32767) / 32767
    left, u = _place(KEYS, AT, 40)
    shown = playback.slerp_raw(keys, left, u)
    for f, (k, share) in enumerate(zip(left[0].tolist(), u[0].tolist(), strict=True)):
        for t in range(40):
            expected = _as_three(keys[:, t, k], keys[:, t, k + 1], share)
            off = shown[:, t, f] - math.copysign(1, expected @ shown[:, t, f]) * expected
            assert np.linalg.norm(off) < 1e-5  # where lengths are off by up to 3e-5
    at_keys = playback.slerp_raw(keys, *_place(KEYS, KEYS, 40))
    assert np.minimum(np.abs(at_keys - keys).max(axis=0), np.abs(at_keys + keys).max(axis=0)).max() < 1e-15


@pytest.mark.parametrize("degrees", [1e-6, 1, 90, 179, 179.999, 180])
def test_steps_of_any_size_turn_evenly(degrees: float) -> None:
    keys = _one(about("y", [10, 10 + degrees]))
    shown = playback.slerp_raw(keys, *_place(np.array([0.0, 1.0]), np.linspace(0, 1, 9), 1))[:, 0]
    assert np.isfinite(shown).all()
    turned = np.degrees(np.unwrap(2 * np.arctan2(shown[1], shown[3]))) - 10
    way = -1 if degrees == 180 and turned[1] < 0 else 1  # half a turn has two shortest ways
    assert turned == pytest.approx(way * degrees * np.linspace(0, 1, 9), abs=1e-5)


def test_equal_keys_stay_as_they_are_stored() -> None:
    keys = _one(np.tile([0.1, 0.2, 0.3, 0.9], (3, 1)))
    shown = playback.slerp_raw(keys, *_place(np.arange(3.0), np.linspace(0, 2, 11), 1))
    assert shown == pytest.approx(np.broadcast_to(keys[:, :, :1], shown.shape), abs=1e-15)


@pytest.mark.parametrize("play", [playback.slerp_raw, playback.nlerp, playback.lerp])
def test_a_single_key_is_shown_at_all_times(play: object) -> None:
    assert callable(play)
    keys = _turns(3)[..., :1]
    shown = play(keys, *_place(KEYS[:1], AT, 3))
    assert shown == pytest.approx(np.broadcast_to(keys, (4, 3, len(AT))), abs=1e-15)


def test_chords_are_mixed_by_components_then_normalized() -> None:
    keys = _turns(5) * RNG.uniform(0.98, 1.02, (5, len(KEYS)))
    left, u = _place(KEYS, AT, 5)
    shown = playback.nlerp(keys, left, u)
    for f, (k, share) in enumerate(zip(left[0].tolist(), u[0].tolist(), strict=True)):
        for t in range(5):
            a, b = keys[:, t, k], keys[:, t, k + 1]
            mix = (1 - share) * a + share * (b if a @ b >= 0 else -b)
            assert shown[:, t, f] == pytest.approx(mix / math.sqrt(mix @ mix), abs=1e-12)


def test_lines_are_numpys() -> None:
    keys = RNG.normal(size=(3, 4, len(KEYS)))
    shown = playback.lerp(keys, *_place(KEYS, AT, 4))
    for c in range(3):
        for t in range(4):
            assert shown[c, t] == pytest.approx(np.interp(AT, KEYS, keys[c, t]), abs=1e-12)


@pytest.mark.parametrize("play", [playback.slerp_raw, playback.nlerp, playback.lerp])
def test_tracks_of_other_key_times_are_shown_as_each_alone(play: object) -> None:
    """Tracks of five keys, three and two, whose rows are filled up with any keys."""
    assert callable(play)
    keys, counts = _turns(3), (5, 3, 2)
    places = [_place(KEYS[:count] * (t + 1), AT, 1) for t, count in enumerate(counts)]
    together = play(keys, *(np.concatenate(each) for each in zip(*places, strict=True)))
    for t, (count, place) in enumerate(zip(counts, places, strict=True)):
        np.testing.assert_array_equal(together[:, t : t + 1], play(keys[:, t : t + 1, :count], *place))


@pytest.mark.parametrize("degrees", [20, 60, 90])
def test_how_far_chord_and_arc_are_apart(degrees: float) -> None:
    keys = _one(about("x", [0, degrees]))
    place = _place(np.array([0.0, 1.0]), np.linspace(0, 1, 2001), 1)
    arcs, chords = (Rotation.from_quat(play(keys, *place)[:, 0].T) for play in (playback.slerp_raw, playback.nlerp))
    apart = (arcs * chords.inv()).magnitude().max()
    assert float(playback.arc_distance(np.radians(degrees))) == pytest.approx(apart, rel=0.04)


def test_steps_are_the_turns_from_key_to_key() -> None:
    keys = np.moveaxis(_turns(3), 0, 2)  # (T, K, 4)
    found = playback.steps(np.swapaxes(keys, 0, 1))
    for t in range(3):
        turns = Rotation.from_quat(keys[t])
        assert found[:, t] == pytest.approx((turns[1:] * turns[:-1].inv()).magnitude(), abs=1e-7)


def test_dots_and_lengths_are_numpys() -> None:
    a, b = RNG.normal(size=(2, 4, 3, 5))
    assert playback.dot(a, b) == pytest.approx(np.einsum("ctk,ctk->tk", a, b))
    assert playback.normalize(a) == pytest.approx(a / np.linalg.norm(a, axis=0))


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
    keys, place = _turns(3), _place(KEYS, AT, 3)
    whole = playback.slerp_raw(keys, *place)
    monkeypatch.setattr(playback, "MAX_MIXED_VALUES", 50)
    np.testing.assert_array_equal(playback.slerp_raw(keys, *place), whole)
