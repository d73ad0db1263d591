"""The one number that reports name: the largest distance at any time, against closed forms and brute force."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from anim.arrays import Floats
from anim.curves.tangents.table import TANGENTS
from anim.gltf.reading import reader
from anim.measure.continuous_bound.largest_error import is_closed, largest_error
from anim.measure.continuous_bound.prover import Proof, Prover
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.sample_times import cut_times, dense_times
from anim.model import Clip, Scene
from anim.operations.resample import resample
from anim.operations.spline import spline
from tests.anim.measure.error.brute_force import Find, brute, points_on_a_node
from tests.clips import CUBICSPLINE, LINEAR, STEP, about, clip, track
from tests.files import opened_path

SMOOTHSTEP = np.sqrt(3) / 18  # the largest distance of 3u² − 2u³ from u; it is 0 at both ends and half-way
NEAR = 0.01
POINT = points_on_a_node([[0, 0, 0], [1, 0, 0]], targets=[[[0, 0, 0], [0, 2, 0]]])


def _found(scene: Scene, before: Clip, after: Clip) -> Proof:
    return largest_error(Prover(ErrorMetric(scene)), before, after)


def _flat(path: str, values: Floats, mode: str) -> Clip:
    """Two keys 2 s apart, joined by a line or by a cubic that starts and ends at rest."""
    if mode == "line":
        return clip(track(path, [0, 2], values))
    return clip(track(path, [0, 2], values, CUBICSPLINE, tangents=(np.zeros_like(values), np.zeros_like(values))))


@pytest.mark.parametrize(
    ("path", "values", "reach"),
    [("translation", [[0.0, 0, 0], [0, 3, 0]], 3.0), ("weights", [[0.0], [1.0]], 2.0)],
)
def test_smoothstep_against_a_line(path: str, values: list[list[float]], reach: float) -> None:
    line, smooth = (_flat(path, np.array(values), mode) for mode in ("line", "cubic"))
    for before, after in ((line, smooth), (smooth, line)):
        found = _found(POINT, before, after)
        assert found.error.max_error == pytest.approx(SMOOTHSTEP * reach, rel=NEAR)
        assert found.bound is not None
        assert SMOOTHSTEP * reach <= found.bound * (1 + 1e-9)
        assert is_closed(found, 1.0)


def test_a_turn_that_is_eased() -> None:
    """Both are half-way at half the time: brute force at every millisecond."""
    line, smooth = (_flat("rotation", about("z", [0, 90]), mode) for mode in ("line", "cubic"))
    truth = brute(POINT, line, smooth, np.linspace(0, 2, 2001))
    assert truth > 0.1
    assert _found(POINT, line, smooth).error.max_error == pytest.approx(truth, rel=NEAR)


@pytest.mark.parametrize("short", [1e-3, 1.0, 50.0])
def test_an_error_shows_however_long_or_short_the_clip_is(short: float) -> None:
    values = np.array([[0.0, 0, 0], [0, 1, 0]])
    line = clip(track("translation", [0, short], values))
    smooth = clip(track("translation", [0, short], values, CUBICSPLINE, tangents=(0 * values, 0 * values)))
    assert _found(POINT, line, smooth).error.max_error == pytest.approx(SMOOTHSTEP, rel=NEAR)


def test_just_before_a_jump() -> None:
    """A line nears 1 m while a STEP track still holds 0; another goes away from it."""
    up = np.array([[0.0, 0, 0], [0, 1, 0], [0, 0, 0]])
    line, step = (clip(track("translation", [0, 1, 2], up, mode)) for mode in (LINEAR, STEP))
    for before, after in ((line, step), (step, line)):
        found = _found(POINT, before, after).error
        assert found.max_error == pytest.approx(1)
        assert found.time == pytest.approx(1) or found.time == pytest.approx(2)


def test_a_clip_against_itself_and_nothing() -> None:
    same = clip(track("translation", [0, 1], [[0, 0, 0], [0, 1, 0]]))
    assert _found(POINT, same, same).error.max_error == 0
    assert _found(POINT, clip(), clip()).error.max_error == 0


def test_what_is_not_proven_is_not_closed() -> None:
    """A quaternion that runs through zero: no one can say how fast it turns there."""
    ends = np.array([[0.0, 0, 0, 1], [0, 0, 0, -1]])
    through = clip(track("rotation", [0, 1], ends, CUBICSPLINE, tangents=(0 * ends, 0 * ends)))
    found = _found(POINT, through, clip(track("rotation", [0, 1], about("z", [0, 60]))))
    assert found.bound is None
    assert not is_closed(found, 1.0)


def test_a_floor_leaves_out_what_is_less() -> None:
    """With more known from elsewhere, nothing is refined, and what is found stays below."""
    line, smooth = (_flat("translation", np.array([[0.0, 0, 0], [0, 1, 0]]), mode) for mode in ("line", "cubic"))
    found = largest_error(Prover(ErrorMetric(POINT)), line, smooth, floor=5.0)
    assert found.error.max_error <= 0.1
    assert is_closed(found, 1.0, floor=5.0)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("Fox.glb", "spline"),
        ("RiggedSimple.gltf", "cubicspline"),
        ("SimpleMorph.gltf", "spline"),
        ("SimpleMorph.gltf", "step"),
        pytest.param("Robot.glb", "spline", marks=pytest.mark.slow),
    ],
)
def test_real_files(asset: Find, name: str, change: str) -> None:
    document = opened_path(asset(name))
    scene = reader.scene(document)
    for before in reader.clips(document)[:3]:
        after = CHANGES[change](before)
        found = _found(scene, before, after)
        coarse = dense_times(before, after, fps=60)
        around = np.linspace(max(found.error.time - 0.02, 0), found.error.time + 0.02, 81)
        truth = brute(scene, before, after, np.sort(np.concatenate((coarse, around))))
        assert found.error.max_error >= (1 - NEAR) * truth
        assert found.error.max_error <= truth * 1.002 + 1e-6 * ErrorMetric(scene).diagonal


def test_times_that_are_looked_at() -> None:
    """Keys, parts of every gap, and the last moment before a STEP key."""
    moves = clip(track("translation", [0, 1, 1.5], np.zeros((3, 3))))
    assert cut_times(moves, parts=2, step=0.4).tolist() == pytest.approx([0, 1 / 3, 2 / 3, 1, 1.25, 1.5])
    jumps = clip(track("translation", [0, 1], np.zeros((2, 3)), STEP))
    assert cut_times(jumps, parts=1, step=9).tolist() == [0, np.nextafter(1.0, 0), 1]
    assert cut_times(clip(), parts=4, step=1).tolist() == [0]


CHANGES: dict[str, Callable[[Clip], Clip]] = {
    "spline": lambda each: spline(each, tangents=TANGENTS["catmull-rom"]),
    "cubicspline": lambda each: resample(each, fps=24, interpolation="cubicspline"),
    "step": lambda each: resample(each, fps=10, interpolation="step"),
}
