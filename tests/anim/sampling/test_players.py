"""Players against closed forms, and three.js's own against three.js itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike

from anim.arrays import Floats
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.maths import matrix, quaternion
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.sample_times import dense_times
from anim.model import AccessorFormat, Clip, Interpolation, Track
from anim.sampling import sample_pose
from anim.sampling.players import PLAYERS, sampler_for
from tests.clips import CUBICSPLINE, LINEAR, STEP, about, clip, skeleton, track
from tests.files import glb_of, opened_fixture
from tests.judge import judge, needs_judge

INT16 = AccessorFormat(5122, True)
NAMES = sorted(PLAYERS)


@pytest.mark.parametrize("player", NAMES)
def test_unit_keys_near_each_other_are_played_the_same_everywhere(player: str) -> None:
    """Within 2° the chord and the arc differ by less than a millionth of a turn."""
    turning = clip(track("rotation", [0, 1, 2], about("y", [0, 1, 3])))
    times = np.linspace(-0.5, 2.5, 61)
    expected = sample_pose(skeleton([-1]), turning, times).rotation
    found = sampler_for(skeleton([-1]), turning, player=player).at(times).rotation
    assert quaternion.angle_between(quaternion.normalize(found), expected).max() < 1e-6


def test_the_spec_is_the_plain_way() -> None:
    moving = clip(track("rotation", [0, 1], 1.01 * about("y", [0, 90])))
    times = np.linspace(0, 1, 11)
    expected = sample_pose(skeleton([-1]), moving, times).rotation
    assert np.array_equal(sampler_for(skeleton([-1]), moving).at(times).rotation, expected)


def test_component_by_component_over_a_quarter_turn_is_092_degrees_off() -> None:
    """A chord of a quarter turn: tan of the half angle is u sin 45° / (1 − u + u cos 45°)."""
    u = np.linspace(0, 1, 101)
    found = _turned("nlerp", about("y", [0, 90]), u)
    half = np.pi / 4
    angles = 2 * np.arctan2(u * np.sin(half), 1 - u + u * np.cos(half))
    assert quaternion.rotation_vector(found)[:, 1] == pytest.approx(angles, abs=1e-12)
    assert np.degrees(np.abs(angles - u * np.pi / 2).max()) == pytest.approx(0.92, abs=0.005)


def test_uneven_keys_bend_component_by_component() -> None:
    """A key twice as long draws the chord to its side: at the middle, 90° at weight 2 counts as two thirds."""
    keys = about("y", [0, 90]) * [[1], [2]]
    expected = quaternion.normalize(about("y", 0) + 2 * about("y", 90))
    assert _turned("nlerp", keys, [0.5])[0] == pytest.approx(expected, abs=1e-12)
    assert _turned("spec", keys, [0.5])[0] == pytest.approx(about("y", 45), abs=1e-12)


def test_what_is_stored_is_taken_as_it_is() -> None:
    """slerp by Shoemake's formula with the keys' own dot product; keys of 1.01 scale what they turn."""
    keys = 1.01 * about("z", [0, 80])
    theta = np.arccos(1.01**2 * np.cos(np.radians(40)))
    expected = (np.sin(0.75 * theta) * keys[0] + np.sin(0.25 * theta) * keys[1]) / np.sin(theta)
    for player in ("raw", "three"):
        assert _turned(player, keys, [0.25])[0] == pytest.approx(expected, abs=1e-14)
        assert np.array_equal(_turned(player, keys, [-1, 2]), keys)
    quarter = matrix.from_trs(np.zeros((1, 3)), 1.01 * about("z", [90]), np.ones((1, 3)))[0]
    assert quarter[:2, 0] == pytest.approx([1 - 1.01**2, 1.01**2])  # 1 − 2z², 2zw: what compose() makes of it


def test_only_three_normalizes_between_near_keys() -> None:
    keys = 1.001 * about("x", [0, 1])
    assert np.linalg.norm(_turned("three", keys, [0.5])) == pytest.approx(1, abs=1e-15)
    assert np.linalg.norm(_turned("raw", keys, [0.5])) == pytest.approx(1.001 * np.cos(np.radians(0.25)), abs=1e-12)
    still = 1.001 * about("x", [30, 30])
    assert np.array_equal(_turned("three", still, [0.5])[0], still[0])


@pytest.mark.parametrize("player", NAMES)
def test_the_shorter_way_is_taken(player: str) -> None:
    keys = about("y", [0, 60]) * [[1], [-1]]
    found = _turned(player, keys, [0.5])[0]
    assert quaternion.angle_between(found, about("y", 30)) < 1e-12


@pytest.mark.parametrize("player", NAMES)
def test_steps_and_splines(player: str) -> None:
    keys = 1.01 * about("y", [0, 60])
    step = _turned(player, keys, [0.5], STEP)[0]
    is_raw = player in ("raw", "three")
    assert np.linalg.norm(step) == pytest.approx(1.01 if is_raw else 1)
    zero = np.zeros((2, 4))
    spline = clip(track("rotation", [0, 1], keys, CUBICSPLINE, tangents=(zero, zero)))
    assert np.linalg.norm(
        sampler_for(skeleton([-1]), spline, player=player).at(np.array([0.5])).rotation
    ) == pytest.approx(1)


def test_other_tracks_are_played_alike() -> None:
    moving = clip(track("translation", [0, 1], [[0, 0, 0], [1, 2, 3]]), track("scale", [0, 1], [[1, 1, 1], [2, 2, 2]]))
    for player in NAMES:
        found = sampler_for(skeleton([-1]), moving, player=player).at(np.array([0.5]))
        assert found.translation[0, 0].tolist() == [0.5, 1, 1.5]
        assert found.scale[0, 0].tolist() == [1.5] * 3


@needs_judge
@pytest.mark.parametrize("storage", [INT16, AccessorFormat(5120, True)], ids=["int16", "int8"])
def test_three_plays_quantized_rotations_so(storage: AccessorFormat, tmp_path: Path) -> None:
    """int8 keys are up to 1 % too long or too short; three.js takes them so, and so does its player here."""
    document = opened_fixture("biped")
    number = next(i for i, name in enumerate(reader.names(document)) if name == "walk")
    (before,) = [each for each in reader.clips(document) if each.name == "walk"]
    coarse = writer.replace_clips(document, {number: _stored(before, storage)})
    truth, other = _saved(tmp_path / "a.glb", document), _saved(tmp_path / "b.glb", coarse)
    verdict = next(each for each in judge(truth, other).clips if each.name == "walk")
    after = reader.clips(coarse)[number]
    ruler, times = ErrorMetric(reader.scene(document)), dense_times(before, after)
    found = {player: ruler.error_at(before, after, times, player=player).max_error for player in NAMES}
    assert found["three"] == pytest.approx(verdict.max_error, rel=0.01)
    assert abs(found["spec"] / found["three"] - 1) > 0.02  # the two can be told apart


def _turned(player: str, keys: Floats, at: ArrayLike, mode: Interpolation = LINEAR) -> Floats:
    turning = clip(track("rotation", [0, 1], keys, mode))
    return sampler_for(skeleton([-1]), turning, player=player).at(np.asarray(at, float)).rotation[:, 0]


def _stored(before: Clip, storage: AccessorFormat) -> Clip:
    """The clip with rotations rounded to integers, and stored so."""
    most = {5122: 32767, 5120: 127}[storage.component_type]
    return Clip(before.name, tuple(_rounded(each, storage, most) for each in before.tracks))


def _rounded(each: Track, storage: AccessorFormat, most: int) -> Track:
    if each.path != "rotation":
        return each
    values = np.round(each.values * most) / most
    return Track(each.node, each.path, each.interpolation, each.times, values, storage=storage)


def _saved(path: Path, document: Document) -> Path:
    path.write_bytes(glb_of(document))
    return path
