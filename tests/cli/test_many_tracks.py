"""Files of many nodes that move: rotations are computed for all of them at once, not node by node."""

from __future__ import annotations

from pathlib import Path

import pytest

from anim.exchange import stick_mesh
from anim.exchange.euler import curve
from anim.maths import quaternion
from anim.measure.continuous_bound import interval_rise
from anim.measure.error.metric import ErrorMetric
from anim.operations import ease
from tests import many
from tests.calls import count_calls
from tests.cli.conftest import Call
from tests.cli.running import refusal
from tests.files import clips_of

NODES = 300
MAX_CALLS = 100  # of a function on quaternions, in one command


@pytest.mark.parametrize("make", [many.side_moving, many.chain_open, many.chain_bare])
@pytest.mark.parametrize("name", ["multiply", "slerp", "angle_between"])
def test_a_bvh_of_many_nodes(
    make: many.Make, name: str, call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "in.glb").write_bytes(make(NODES))
    counted = count_calls(monkeypatch, quaternion, name)
    call("to-euler", tmp_path / "in.glb", tmp_path / "out.bvh", "--fps", "3").product()
    assert 0 < len(counted) < MAX_CALLS


def test_joints_of_a_bvh_that_do_not_turn_have_no_curves(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "in.glb").write_bytes(many.chain(NODES))
    counted = count_calls(monkeypatch, curve.Curve, "__post_init__")
    call("to-euler", tmp_path / "in.glb", tmp_path / "out.bvh").product()
    assert 0 < len(counted) < 10


def test_equal_clips_are_not_sampled(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    counted = count_calls(monkeypatch, ErrorMetric, "sample_errors")
    (tmp_path / "in.glb").write_bytes(many.side_moving(5))
    report = call("diff", tmp_path / "in.glb", tmp_path / "in.glb", "--format", "json").json
    assert report["clips"][0]["max_error_m"] == 0
    assert not counted
    (tmp_path / "other.glb").write_bytes(many.chain_open(5))  # equal clips, on other nodes
    assert call("diff", tmp_path / "in.glb", tmp_path / "other.glb", "--format", "json").json["max_error_m"] > 0
    assert counted


def test_a_clip_that_optimize_leaves_is_not_sampled(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    counted = count_calls(monkeypatch, ErrorMetric, "sample_errors")
    (tmp_path / "in.glb").write_bytes(many.side_moving(20))
    call("optimize", tmp_path / "in.glb", tmp_path / "out.glb").product()
    assert not counted


def test_tracks_are_sorted_once_for_all_steps_of_a_proof(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    counted = count_calls(monkeypatch, interval_rise, "partition_tracks")
    steps = count_calls(monkeypatch, interval_rise, "world_bounds")
    (tmp_path / "in.glb").write_bytes(many.side_moving(2000))
    call("resample", tmp_path / "in.glb", tmp_path / "out.glb", "--fps", "60").product()
    assert len(counted) == 1 < len(steps)


@pytest.mark.parametrize(
    "line",
    [
        ["loop", "IN", "OUT", "--blend", "0.1"],
        ["trim", "IN", "OUT", "--from", "0.1", "--to", "0.7"],
        ["trim", "IN", "OUT", "--from", "0.1", "--to", "0.2"],
        ["spline", "IN", "OUT"],
    ],
)
def test_tracks_of_one_time_axis_are_changed_together(
    line: list[str], call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "in.glb").write_bytes(many.side_moving(NODES))
    counted = [*(count_calls(monkeypatch, quaternion, name) for name in ("slerp", "multiply", "normalize"))]
    call(*({"IN": tmp_path / "in.glb", "OUT": tmp_path / "out.glb"}.get(each, each) for each in line)).product()
    assert all(len(each) < MAX_CALLS for each in counted)
    assert any(counted)


def test_sticks_for_too_many_nodes_are_refused_before_they_are_made(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = count_calls(monkeypatch, stick_mesh, "_bipyramids")
    (tmp_path / "in.glb").write_bytes(many.chain_open(NODES))
    line = ["render", tmp_path / "in.glb", tmp_path / "out.png", "--size", "64", "--memory-limit"]
    assert "decoded data" in refusal(call(*line, "1MB"), 4)
    assert not made
    call(*line, "1GB").product()
    assert made


def test_tracks_that_are_equal_but_for_their_node_are_eased_once(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    counted = count_calls(monkeypatch, ease, "ease_segments")
    (tmp_path / "in.glb").write_bytes(many.side_moving(20))
    call("ease", tmp_path / "in.glb", tmp_path / "out.glb").product()
    assert len(counted) == 1
    tracks = clips_of((tmp_path / "out.glb").read_bytes())[0].tracks
    assert [track.node for track in tracks] == list(range(20))
    assert all((track.values == tracks[0].values).all() for track in tracks)
