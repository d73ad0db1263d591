"""`gltf-anim loop`: its report, and the loops that it closes."""

from __future__ import annotations

import pytest

from tests.cli.conftest import Call, Fixture
from tests.cli.running import help_line, refusal


def test_report_names_the_kind(call: Call, fixture: Fixture) -> None:
    run = call("loop", fixture("biped"), "--clip", "walk")
    assert "closed" in run.text
    assert run.err == ""


def test_json_has_units_in_its_keys(call: Call, fixture: Fixture) -> None:
    report = call("loop", fixture("biped"), "--format", "json").json
    assert report["schema"] == 1
    assert {"clip", "kind", "start_s", "end_s", "seam_m", "speed_seam_m_per_s", "travel_m"} <= report["loops"][0].keys()


def test_find_proposes_ranges(call: Call, fixture: Fixture) -> None:
    found = call("loop", fixture("biped"), "--clip", "walk", "--find", "--format", "json").json["loops"]
    assert found[0]["seam_m"] < 1e-4
    assert found[0]["end_s"] - found[0]["start_s"] >= 0.5


def test_an_open_loop_gets_its_missing_frame(call: Call, fixture: Fixture) -> None:
    cut = call("trim", fixture("biped"), "--clip", "walk", "--to", "0.9583333", "-q").product()
    assert call("loop", "--clip", "walk", "--format", "json", stdin=cut).json["loops"][0]["kind"] == "open by one frame"
    closed = call("loop", "-", "-", "--clip", "walk", "-q", stdin=cut).product()
    found = call("loop", "--clip", "walk", "--format", "json", stdin=closed).json["loops"][0]
    assert found["kind"] == "closed"
    assert found["end_s"] == pytest.approx(1.0, abs=1e-5)


def test_no_loop_needs_a_blend(call: Call, fixture: Fixture) -> None:
    half = call("trim", fixture("biped"), "--clip", "walk", "--to", "0.5", "-q").product()
    run = call("loop", "-", "-", "--clip", "walk", stdin=half)
    assert "is not a loop" in refusal(run, 2)
    assert "--blend" in help_line(run)
    closed = call("loop", "-", "--clip", "walk", "--blend", "0.2", "-q", stdin=half).product()
    assert call("loop", "--clip", "walk", "--format", "json", stdin=closed).json["loops"][0]["kind"] == "closed"
