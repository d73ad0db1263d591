"""The frame rate of `loop`: stated, and given where keys no longer show it."""

from __future__ import annotations

import pytest

from anim.gltf.writing import writer
from anim.model import Clip
from tests.cli.conftest import Call, Fixture
from tests.cli.running import built, refusal
from tests.clips import LINEAR, about, track
from tests.files import glb_of, opened

WALK = ("--clip", "walk", "--format", "json")


def test_steps_compare_before_and_after_an_edit_at_one_rate(call: Call, fixture: Fixture) -> None:
    """The rate was that of the keys alone, and stated in JSON only: a third of the step after `resample --fps 60`."""
    before = fixture("biped")
    after = call("resample", before, "--fps", "60", "-q").product()
    (old,), (new,) = (call("loop", *WALK, stdin=data).json["loops"] for data in (before.read_bytes(), after))
    assert (old["frame_rate_fps"], new["frame_rate_fps"]) == (24, 60)
    assert new["largest_frame_motion_m"] < 0.5 * old["largest_frame_motion_m"]
    assert " at fps " in call("loop", before).text
    (same,) = call("loop", *WALK, "--fps", "24", stdin=after).json["loops"]
    assert same["frame_rate_fps"] == 24
    for key in ("largest_frame_motion_m", "typical_frame_motion_m", "frame_motion_m"):
        assert same[key] == pytest.approx(old[key], rel=0.05)


def test_a_single_pose_has_no_rate(call: Call) -> None:
    document = opened(built("biped"))
    pose = Clip("walk", (track("rotation", [0.0], about("x", [5]), LINEAR, node=0),))
    data = glb_of(writer.replace_clips(document, {0: pose}))
    header, row = call("loop", "--clip", "walk", stdin=data).text.splitlines()[:2]
    assert "a single pose" in row
    assert "at fps" not in header, "a column without cells is left out"


def test_the_missing_frame_is_as_long_as_stated(call: Call, fixture: Fixture) -> None:
    """After `optimize` few keys are left: the frame was one of their spacing."""
    cut = call("trim", fixture("biped"), "--clip", "walk", "--to", "0.9583333", "-q").product()
    closed = call("loop", "-", "-", "--clip", "walk", "--fps", "12", "-q", stdin=cut).product()
    (found,) = call("loop", *WALK, stdin=closed).json["loops"]
    assert found["end_s"] == pytest.approx(0.9583333 + 1 / 12, abs=1e-5)


def test_advice_repeats_the_rate(call: Call, fixture: Fixture) -> None:
    """At which alone the clip is open by one frame."""
    cut = call("trim", fixture("biped"), "--clip", "walk", "--to", "0.9583333", "-q").product()
    (advice,) = call("loop", *WALK, "--fps", "23.976023976", stdin=cut).json["advice"]
    assert advice.endswith("gltf-anim loop IN OUT --fps 23.976023976 --clip '#0'")


@pytest.mark.parametrize("options", [(), ("--find",), ("out.glb",)])
def test_the_rate_is_above_0(options: tuple[str, ...], call: Call, fixture: Fixture) -> None:
    assert "--fps is 0 (expected a number above 0)" in refusal(
        call("loop", fixture("biped"), *options, "--fps", "0"), 2
    )


def test_ranges_are_found_at_the_stated_rate(call: Call, fixture: Fixture) -> None:
    found = call("loop", fixture("biped"), *WALK, "--find", "--fps", "10").json["loops"]
    assert {each["frame_rate_fps"] for each in found} == {10}
    assert all(each["start_s"] * 10 == pytest.approx(round(each["start_s"] * 10)) for each in found)
