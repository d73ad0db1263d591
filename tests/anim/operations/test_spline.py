"""Splined clips: continuity at every key, measured by differences, and agreement with scipy's splines."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from anim.curves.tangents.table import TANGENTS, parse
from anim.errors import RangeError
from anim.maths import quaternion
from anim.model import Clip, Track
from anim.operations.spline import max_key_change, spline
from anim.sampling.derivatives import rates
from anim.sampling.track import sample
from tests import clips
from tests.anim.operations.tracks import KEYS, TRACKS
from tests.clips import CUBICSPLINE, STEP

LINE = clips.track("translation", [0, 1, 2, 3], [[v, 0, 0] for v in (0, 0.9, 0.2, 1)])


def splined(track: Track, name: str, *, cyclic: bool = False) -> Track:
    return spline(Clip("", (track,)), tangents=parse(name), cyclic=cyclic).tracks[0]


def test_catmull_rom_overshoots_the_lesson_values() -> None:
    new = splined(LINE, "catmull-rom")
    assert sample(new, np.linspace(0, 3, 3001))[:, 0].max() > 0.9
    np.testing.assert_allclose(sample(new, LINE.times), LINE.values, atol=1e-15)


@pytest.mark.parametrize("name", [n for n in TANGENTS if n not in ("centripetal", "periodic")])
@pytest.mark.parametrize("key", ["linear", "slerp"])
def test_speed_has_no_jump_at_inner_keys(name: str, key: str) -> None:
    new = splined(TRACKS[key], name)
    before, after = (rates(new, KEYS[1:3], before=side) for side in (True, False))
    np.testing.assert_allclose(before, after, atol=1e-9 * max(1.0, np.abs(before).max()))


def test_natural_is_scipys() -> None:
    new = splined(TRACKS["linear"], "natural")
    times = np.linspace(0, 3, 301)
    oracle = CubicSpline(KEYS, TRACKS["linear"].values, bc_type="natural")
    np.testing.assert_allclose(sample(new, times), oracle(times), atol=1e-12)


@pytest.mark.parametrize("name", ["time-aware", "natural", "akima", "monotone"])
@pytest.mark.parametrize("key", ["linear", "slerp"])
def test_a_cyclic_loop_has_no_seam_in_speed(name: str, key: str) -> None:
    track = TRACKS[key]
    values = track.values.copy()
    values[-1] = values[0]
    new = splined(Track(0, track.path, track.interpolation, track.times, values), name, cyclic=True)
    end, start = rates(new, KEYS[-1:], before=True), rates(new, KEYS[:1], before=False)
    np.testing.assert_allclose(end, start, atol=1e-9 * max(1.0, np.abs(end).max()))


@pytest.mark.parametrize("name", ["time-aware", "catmull-rom", "flat", "clamped", "natural", "periodic"])
@pytest.mark.parametrize("key", ["linear", "slerp"])
def test_a_loop_that_is_open_is_refused_by_every_rule(name: str, key: str) -> None:
    with pytest.raises(RangeError, match=r"node 0, (translation|rotation): the loop is open"):
        splined(TRACKS[key], name, cyclic=True)


def test_the_way_of_a_root_goes_on() -> None:
    line = clips.track("translation", [0, 1, 2, 4], [[v, 0, 0] for v in (0, 1, 3, 4)])
    new = spline(Clip("", (line,)), tangents=parse("catmull-rom"), cyclic=True, root=0).tracks[0]
    end, start = rates(new, line.times[-1:], before=True), rates(new, line.times[:1], before=False)
    np.testing.assert_allclose(end, start, atol=1e-12)


@pytest.mark.parametrize("name", ["time-aware", "natural", "catmull-rom", "akima", "monotone"])
def test_a_loop_track_within_the_clip_gets_keys_at_its_ends(name: str) -> None:
    late = clips.track("translation", [1, 2, 2.5], [[v, 0, 0] for v in (0, 3, 0)])
    whole = clips.track("scale", [0, 3], np.ones((2, 3)), node=1)
    new = spline(Clip("", (late, whole)), tangents=parse(name), cyclic=True).tracks[0]
    np.testing.assert_array_equal(new.times, [0, 1, 2, 2.5, 3])
    np.testing.assert_array_equal(new.values[:, 0], [0, 0, 3, 0, 0])
    end, start = rates(new, np.array([3.0]), before=True), rates(new, np.array([0.0]), before=False)
    np.testing.assert_allclose(end, start, atol=1e-12)


def test_holds_and_single_keys_stay() -> None:
    before = Clip(
        "", (clips.track("scale", [0, 1], np.ones((2, 3)), STEP), clips.track("scale", [0], [[1, 1, 1]], node=1))
    )
    assert spline(before, tangents=TANGENTS["natural"]).tracks == before.tracks


def test_bspline_says_how_far_it_leaves_the_keys() -> None:
    before = Clip("", (LINE, TRACKS["slerp"]))
    after = spline(before, tangents=TANGENTS["bspline"])
    moved, turned = max_key_change(before, after)
    assert moved == pytest.approx(np.abs(after.tracks[0].values - LINE.values).max())
    assert moved > 0.1
    angles = quaternion.angle_between(after.tracks[1].values, TRACKS["slerp"].values)
    assert turned == pytest.approx(angles.max())
    assert max_key_change(before, spline(before, tangents=TANGENTS["natural"]))[0] == 0


def test_tangents_that_were_there_go() -> None:
    cubic = TRACKS["cubic"]
    new = splined(cubic, "flat")
    assert new.interpolation is CUBICSPLINE
    assert not np.asarray(new.in_tangents).any()
