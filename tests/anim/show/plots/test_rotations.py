"""Rotations as degrees: from rest, as Euler angles with their lock, and by components on request."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from anim.gltf.authoring import build_document
from anim.maths import quaternion
from anim.model import Clip, Interpolation
from anim.operations.selection import Selection
from anim.show.plots.rotations import COMPONENTS, FROM_REST, degrees, gimbal_distance_line, rotation_curve
from anim.show.plots.track_plot import track_plot
from anim.show.plots.track_selection import select_tracks
from tests import clips
from tests.anim.show.reading import words
from tests.clips import CUBICSPLINE, LINEAR, STEP, about, track

NONE = np.array([0.0, 0, 0, 1])


def test_degrees_from_rest_are_those_of_scipy() -> None:
    random = np.random.default_rng(3)
    rest = Rotation.from_rotvec(random.uniform(-1, 1, 3))
    vectors = np.cumsum(random.uniform(-0.2, 0.2, (30, 3)), axis=0)
    q = (rest * Rotation.from_rotvec(vectors)).as_quat() * np.where(random.uniform(size=(30, 1)) < 0.5, -1, 1)
    assert degrees(q, view=FROM_REST, rest=rest.as_quat()) == pytest.approx(np.degrees(vectors), abs=1e-9)


def test_a_whole_turn_goes_on_past_its_half() -> None:
    curve = rotation_curve(track("rotation", range(5), about("y", [0, 90, 180, 270, 360])), view=FROM_REST, rest=NONE)
    assert curve.keys[:, 1] == pytest.approx([0, 90, 180, 270, 360], abs=1e-4)
    assert np.diff(curve.line.values[:, 1]).min() > -1e-6


@pytest.mark.parametrize("interpolation", [STEP, LINEAR])
def test_keys_lie_on_their_curve(interpolation: Interpolation) -> None:
    one = track("rotation", [0, 1, 2], about("z", [10, 60, 20]), interpolation)
    curve = rotation_curve(one, view="XYZ", rest=NONE)
    assert curve.keys == pytest.approx(np.array([[0, 0, 10], [0, 0, 60], [0, 0, 20.0]]), abs=1e-4)
    assert (curve.risers is None) == (interpolation is LINEAR)


def test_the_distance_to_lock_is_that_of_the_middle_angle() -> None:
    """ZXY locks where X is a quarter turn: 70° to 110° passes it half-way."""
    found = gimbal_distance_line(track("rotation", [0, 1], about("x", [70, 110])), order="ZXY")
    assert np.degrees(found.values[0, 0]) == pytest.approx(20, abs=1e-4)
    assert found.times[found.values[:, 0].argmin()] == pytest.approx(0.5, abs=0.05)


def test_angles_that_race_near_lock_are_a_smooth_line() -> None:
    """A steady rotation about Y, tilted by 4°: X and Z go through 180° while Y passes 90°."""
    tilted = (
        Rotation.from_euler("Y", [[0], [90], [180]], degrees=True) * Rotation.from_euler("x", 4, degrees=True)
    ).as_quat()
    line = rotation_curve(track("rotation", [0, 1, 2], tilted), view="XYZ", rest=NONE).line
    assert np.ptp(line.values, axis=0) == pytest.approx([172, 86, 180], abs=0.01)
    assert np.abs(np.diff(line.values, axis=0)).max() < 3.1


def _words(view: str, *tracks: object) -> list[str]:
    document = build_document(clips.skeleton([-1, 0, 1]), [Clip("wave", tracks)])  # type: ignore[arg-type]
    return words(track_plot(select_tracks(document, Selection(), limit=9, view=view).shown, title="t", kind="svg"))


def test_words_of_each_view() -> None:
    turning = track("rotation", [0, 1, 2], about("x", [0, 89, 60]), node=1)
    moving = track("translation", [0, 1], [[0, 0, 0], [1, 0, 0]])
    said = _words(FROM_REST, turning, moving)
    assert {"rotation from rest, °  ·  linear, 3 keys", "angle from rest, °"} <= set(said)
    assert said.count("lock") == 0
    said = _words("ZXY", turning, moving)
    assert {"Euler angles ZXY, °  ·  linear, 3 keys", "Z", "X", "Y", "lock"} <= set(said)
    assert "distance to gimbal lock of ZXY: at least 1° at 1 s" in said
    assert not any(text.startswith("translation") for text in said)
    assert "lock" not in _words("XYZ", turning)
    assert {"Z1", "X", "Z2"} <= set(_words("ZXZ", turning))
    said = _words(COMPONENTS, turning)
    assert {"rotation, quaternion  ·  linear, 3 keys", "w", "angle from the first key, °"} <= set(said)


def test_splines_and_poses_can_be_drawn_in_degrees() -> None:
    q = about("x", [0, 40])
    spline = track("rotation", [0, 1], q, CUBICSPLINE, tangents=(q * 0, q * 0))
    for view in (FROM_REST, "YXZ"):
        assert _words(view, spline)
        assert _words(view, track("rotation", [0], about("x", [20])))
        assert _words(view, track("rotation", [0, 1, 2], about("x", [0, 20, 90]), STEP))


def test_vectors_are_continuous_as_by_one_after_the_other() -> None:
    """Blocks are compared at once as long as the number of turns stays."""
    random = np.random.default_rng(5)
    steady = np.cumsum(random.normal(size=700) * 0.3)
    quarters = np.arange(300) * np.pi / 4
    axis = np.array([0.6, 0, 0.8])
    for q in (
        *(np.concatenate((np.sin(a)[:, None] * axis, np.cos(a)[:, None]), axis=1) for a in (steady, quarters)),
        Rotation.random(300, random).as_quat(),
    ):
        expected = np.degrees(quaternion.rotation_vector(quaternion.align_signs(q)))
        for i in range(1, len(expected)):
            if (length := float(np.linalg.norm(expected[i]))) > 0:
                along = expected[i] / length
                expected[i] += np.rint((expected[i - 1] @ along - length) / 360) * 360 * along
        np.testing.assert_allclose(degrees(q, view=FROM_REST, rest=NONE), expected, atol=1e-9)
