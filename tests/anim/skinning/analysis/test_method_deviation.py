"""Methods that lose the model: two halves of a tube that a clip takes far apart and turns round."""

from __future__ import annotations

import numpy as np
import pytest

from anim.gltf.reading import reader
from anim.model import Clip, Scene
from anim.skinning.analysis.collapse import collapse
from anim.skinning.analysis.method_deviation import MeasuredBake, linear_baker, max_distance, model_size
from anim.skinning.analysis.recommendations import CollapseFinding, recommend
from anim.skinning.bake import prepare_bake
from tests.clips import about, clip, track
from tests.files import opened_fixture

FAR = 40.0  # m
TIMES = np.linspace(0, 1, 9)


def test_a_screw_of_a_half_turn_leaves_linear_blending_by_half_its_chord() -> None:
    """Dual quaternions go along a half circle over the chord; the middle is half of the chord away from it."""
    of, played = torn()
    made = prepare_bake(of, method="dqs")
    found = MeasuredBake(made, linear_baker(made, space="world"), played, TIMES).deviation()
    assert found.distance == pytest.approx(FAR / 2, rel=0.05)
    assert found.time == 1
    assert found.distance > model_size(made) == pytest.approx(np.linalg.norm([0.2, 0.2, 1]), rel=0.01)


def test_every_frame_is_looked_at() -> None:
    """Torn in one of a thousand frames."""
    of, _ = torn()
    times = np.arange(1000) / 30
    places, turns = np.tile([0, 0.5, 0], (1000, 1)), np.zeros(1000)
    places[617], turns[617] = [0, FAR, 0], 179.9
    played = clip(track("translation", times, places, node=1), track("rotation", times, about("x", turns), node=1))
    made = prepare_bake(of, method="dqs")
    found = MeasuredBake(made, linear_baker(made, space="world"), played, times).deviation()
    assert found.distance == pytest.approx(FAR / 2, rel=0.05)
    assert found.time == times[617]


@pytest.mark.parametrize("scale", [1.0, 1e20, 3e38])
def test_the_largest_distance_of_large_coordinates_is_finite(scale: float) -> None:
    """float32 has no square of 1e20 m, nor the difference of two numbers near its end: `bake` warned of inf m."""
    positions = np.array([[[1, 0, 0], [0, 1, 0]], [[0, 0, 0], [0, 0, 0]]], np.float32) * np.float32(scale)
    found = max_distance(positions, -positions)
    np.testing.assert_allclose(found, [2 * scale, 0], rtol=1e-6)


def test_linear_blending_is_not_off_itself() -> None:
    of, played = torn()
    made = prepare_bake(of)
    assert MeasuredBake(made, linear_baker(made, space="world"), played, TIMES).deviation().distance == 0


def test_the_first_complete_pass_measures() -> None:
    """A pass that is left, as by a format that needs one chunk only, measures nothing; later passes bake once."""
    of, played = torn()
    made, times = prepare_bake(of, method="dqs"), np.linspace(0, 1, 500)
    linear = linear_baker(made, space="world")
    passes: list[int] = []
    measured = MeasuredBake(made, linear, played, times, passes.append)
    next(measured.cache.chunks())
    frames = measured.cache.load_all().positions
    np.testing.assert_array_equal(frames, made.bake(played, times=times).load_all().positions)
    baked = len(passes)
    apart = max_distance(frames, linear.bake(played, times=times).load_all().positions)
    assert measured.deviation() == (apart.max(), times[apart.argmax()], model_size(made))
    assert len(passes) == baked


def test_collapse_never_advises_such_a_method() -> None:
    of, played = torn()
    (mesh,) = collapse(of, played, times=TIMES, methods=("lbs", "dqs", "cor"))
    unusable = {each.method: each.unusable for each in mesh.methods}
    assert unusable == {"lbs": False, "dqs": True, "cor": False}
    lines = list(recommend([CollapseFinding(0, "torn", mesh)]))
    assert lines[0].startswith("dqs can't be used: a vertex is 19.7 m from")
    assert "('torn', 1.00 s)" in lines[0]
    assert not [line for line in lines if "--method dqs" in line or "dqs keeps" in line]


def torn() -> tuple[Scene, Clip]:
    """The tube, and a clip that turns its upper half by 180° about x and takes it 40 m along y."""
    moved = track("translation", [0, 1], [[0, 0.5, 0], [0, FAR, 0]], node=1)
    turned = track("rotation", [0, 1], about("x", [0, 179.9]), node=1)
    return reader.scene(opened_fixture("tube")), clip(moved, turned, name="torn")
