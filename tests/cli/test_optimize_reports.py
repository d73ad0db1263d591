"""`optimize`: pipes, reports and curves, what it says and in which form."""

from __future__ import annotations

import gzip
import json
import math
import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from anim.gltf.reading import reader
from tests.cli.comparing import apart
from tests.cli.conftest import Call, Fixture
from tests.cli.running import refusal, shell, table
from tests.files import glb_of, opened_fixture, opened_path

FAST = ("--effort", "fast")


def _numbers(content: Any) -> Iterator[float]:
    if isinstance(content, dict):
        content = list(content.values())
    if isinstance(content, list):
        for each in content:
            yield from _numbers(each)
    elif isinstance(content, float):
        yield content


def test_pipes(tmp_path: Path, fixture: Fixture, call: Call) -> None:
    source = fixture("noop")
    run = call("optimize", "-", "-", *FAST, stdin=source.read_bytes())
    assert len(run.product()) < source.stat().st_size
    direct = tmp_path / "direct.glb"
    assert call("optimize", source, direct, *FAST).code == 0
    assert run.product() == direct.read_bytes()
    line = f"gltf-anim optimize {source.name} --effort fast -q | gltf-anim inspect --format json"
    assert json.loads(shell(line, tmp_path).product())["schema"] == 1


def test_the_report(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    source, output, report = fixture("noop"), tmp_path / "out.glb", tmp_path / "report.json"
    run = call("optimize", source, output, "--max-error", "0.1%", "--drop", "rest", "--report", report, *FAST)
    assert run.code == 0, run.err
    found = json.loads(report.read_text(encoding="utf-8"), parse_constant=lambda name: pytest.fail(name))
    assert found["schema"] == 1
    assert all(math.isfinite(number) for number in _numbers(found))
    assert found["bytes"]["before"]["file"] == source.stat().st_size
    assert found["bytes"]["after"]["file"] == output.stat().st_size
    assert found["bounds"]["max_error_m"] == pytest.approx(1e-3 * found["diagonal_m"])
    assert found["policy"]["drop"] == "rest"
    old, new = (reader.clips(opened_path(path)) for path in (source, output))
    by_clip = {each["clip"]: each for each in apart(call, source, output)["clips"]}
    assert [each["name"] for each in found["clips"]] == [each.name for each in old]
    for each, a, b in zip(found["clips"], old, new, strict=True):
        assert each["keys_before"] == sum(len(track.times) for track in a.tracks)
        assert each["keys_after"] == sum(len(track.times) for track in b.tracks)
        assert (each["tracks_before"], each["tracks_after"]) == (len(a.tracks), len(b.tracks))
        assert len(each["dropped"]) == len(a.tracks) - len(b.tracks)
        assert {"name", "node", "path"} <= set().union(*each["dropped"], {"name", "node", "path"})
        assert each["end_s"] == a.end
        assert each["mean_m"] <= each["p99_m"] <= each["max_error_m"] * (1 + 1e-9) <= 1e-3 * found["diagonal_m"]
        assert each["max_error_m"] <= each["certified_error_m"] <= 1e-3 * found["diagonal_m"]
        assert each["not_certified_because"] is None
        assert each["max_error_m"] >= by_clip[a.name]["max_error_m"] * (1 - 2e-3)  # that of one player
    assert any(each["dropped"] for each in found["clips"])


def test_a_report_says_why_nothing_changed(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    once, report = tmp_path / "once.glb", tmp_path / "report.json"
    reasons = []
    for source, bound in ((fixture("noop"), "1%"), (once, "1%"), (once, "0")):
        assert call("optimize", source, once, "--max-error", bound, "--report", report, *FAST).code == 0
        said = json.loads(report.read_text())
        reasons.append(said["unchanged_because"])
        assert said["unchanged"] is (reasons[-1] is not None)
    assert reasons == [None, "optimized like this before", "no smaller file within the bound"]


def test_a_file_that_fits_its_byte_limit_says_so(walk: Path, tmp_path: Path, call: Call) -> None:
    """And not that no smaller file is within the bound."""
    once, again = tmp_path / "once.glb", tmp_path / "again.glb"
    call("optimize", walk, once, "--max-error", "0", *FAST).product()
    run = call("optimize", once, again, "--max-error", "1%", "--max-bytes", "10MB", *FAST)
    assert "unchanged: it fits --max-bytes as it is" in run.err


def test_the_report_on_stdout_beside_a_file(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    run = call("optimize", fixture("noop"), tmp_path / "out.glb", "--report", "-", *FAST)
    assert run.json["unchanged"] is False
    assert "can't both be stdout" in refusal(call("optimize", fixture("noop"), "--report", "-", *FAST), 2)


@pytest.mark.parametrize("ending", ["glb", "gltf"])
def test_a_report_that_fails_leaves_the_model(ending: str, fixture: Fixture, tmp_path: Path, call: Call) -> None:
    source, output = fixture("noop"), tmp_path / f"out.{ending}"
    assert call("convert", source, output).code == 0
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    run = call("optimize", source, output, "--max-error", "1%", "--report", "/dev/full", *FAST)
    assert "/dev/full: can't be written (no space left on device)" in refusal(run, 3)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_model_that_fails_leaves_the_report(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    source, report = fixture("noop"), tmp_path / "report.json"
    report.write_text("as it was")
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    run = call("optimize", source, "/dev/full", "--report", report, *FAST)
    assert "/dev/full: can't be written" in refusal(run, 3)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_report_that_nobody_may_write_is_refused_before_the_search(
    fixture: Fixture, tmp_path: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, input = tmp_path / "closed", tmp_path / "no model.glb"
    folder.mkdir()
    input.write_bytes(b"")  # is never read
    allowed = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: path != folder and allowed(path, mode))  # root may everything
    run = call("optimize", input, tmp_path / "out.glb", "--report", folder / "report.json")
    assert "report.json: can't be written (no permission" in refusal(run, 3)


def test_words(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    run = call("optimize", fixture("noop"), tmp_path / "out.glb", "--drop", "rest", "-v", *FAST)
    assert "dropped " in run.err
    assert "--drop rest)" in run.err
    lines = [line for line in run.err.splitlines() if line.startswith("  clip ")]
    assert len(lines) == len(reader.clips(opened_fixture("noop")))
    assert all(("p99 " in line and "mean " in line) is ("no vertex moved" not in line) for line in lines)
    assert any("p99 " in line for line in lines)
    assert all(("at any time" in line) is ("no vertex moved" not in line) for line in lines)
    assert ", bound holds at all times, " in run.err.splitlines()[0]
    keys = call("optimize", fixture("noop"), tmp_path / "keys.glb", "--reference", "keys", "-v", *FAST).err
    assert "any time" not in keys
    assert "proven" not in keys
    assert call("optimize", fixture("noop"), tmp_path / "quiet.glb", "-q", *FAST).err == ""
    exact = call("optimize", fixture("biped"), tmp_path / "exact.glb", "--max-error", "0", *FAST).err  # rounding only
    assert ", no vertex moved, " in exact.splitlines()[0]
    assert (tmp_path / "quiet.glb").is_file()


def test_a_curve_as_csv(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    run = call("optimize", fixture("noop"), "--curve", tmp_path / "curve.csv")
    assert (run.code, run.out) == (0, b"")
    rows = table((tmp_path / "curve.csv").read_bytes())
    assert list(rows[0]) == ["max_error_m", "share_of_diagonal", "bytes", "error_m", "animation_bytes"]
    shares = [float(row["share_of_diagonal"]) for row in rows]
    assert [*shares[:2], *shares[-2:]] == pytest.approx([0, 1e-5, 1e-2, 0.1])
    others = [int(row["bytes"]) - int(row["animation_bytes"]) for row in rows]  # what is no animation, but for padding
    assert max(others) - min(others) < 200
    assert shares == sorted(shares)
    assert all(float(row["error_m"]) <= float(row["max_error_m"]) + 1e-9 for row in rows)
    assert int(rows[-1]["bytes"]) < int(rows[0]["bytes"]) < fixture("noop").stat().st_size
    said = run.err.splitlines()
    assert (said[0], len(said) - 1) == ("  sizes of --effort fast", len(rows))


def test_a_file_without_animation_has_no_curve(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    path = tmp_path / "curve.csv"
    said = refusal(call("optimize", fixture("wall"), "--curve", path), 5)
    assert said.endswith("wall.glb: has no animation, whose size the curve would show")
    assert not path.exists()


def test_a_curve_has_the_sizes_of_its_effort(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    """They were those of a fast search, whatever was asked for: `optimize` then gave others."""
    sizes = {}
    for effort in ((), ("--effort", "balanced")):
        run = call("optimize", fixture("noop"), "--curve", tmp_path / "curve.csv", *effort)
        assert run.err.startswith(f"  sizes of --effort {effort[-1] if effort else 'fast'}\n")
        rows = table((tmp_path / "curve.csv").read_bytes())
        (sizes[effort],) = [int(row["bytes"]) for row in rows if float(row["share_of_diagonal"]) == 1e-3]
    assert call("optimize", fixture("noop"), tmp_path / "out.glb", "--max-error", "0.1%").code == 0
    assert sizes["--effort", "balanced"] == (tmp_path / "out.glb").stat().st_size != sizes[()]


def test_a_curve_states_no_error_where_the_file_stays(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    compressed, path = tmp_path / "compressed.glb", tmp_path / "curve.csv"
    assert call("optimize", fixture("arm"), compressed, "--max-error", "0", "--meshopt", "ext", *FAST).code == 0
    assert call("optimize", compressed, "--curve", path, "-q").code == 0  # without the codec: larger at most bounds
    unchanged = [row for row in table(path.read_bytes()) if int(row["bytes"]) == compressed.stat().st_size]
    assert len(unchanged) > 1
    assert {float(row["error_m"]) for row in unchanged} == {0.0}


@pytest.mark.parametrize(("ending", "start"), [("png", b"\x89PNG"), ("svg", b"<?xml")])
def test_a_curve_as_a_picture(ending: str, start: bytes, fixture: Fixture, tmp_path: Path, call: Call) -> None:
    path = tmp_path / f"curve.{ending}"
    assert call("optimize", fixture("arm"), "--curve", path, "-q").code == 0
    assert path.read_bytes().startswith(start)


def test_gzip_as_objective(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    sizes = {}
    for objective in ("file", "gzip"):
        path = tmp_path / f"{objective}.glb"
        assert call("optimize", fixture("noop"), path, "--objective", objective, "--max-error", "1%", *FAST).code == 0
        sizes[objective] = (path.stat().st_size, len(gzip.compress(path.read_bytes(), 9)))
    assert sizes["file"][0] <= sizes["gzip"][0]


def _with_numbers(fixture: Fixture, folder: Path, place: str) -> Path:
    """A file that holds all small numbers at one place of a node, so that each of its accessors might be meant."""
    document = opened_fixture("noop")
    node = {**document.json["nodes"][0], place: {"ACME_ids": list(range(80))}}
    json = {**document.json, "nodes": [node, *document.json["nodes"][1:]]}
    path = folder / "numbered.glb"
    path.write_bytes(glb_of(replace(document, json=json)))
    return path


def test_numbers_in_extras_refer_to_nothing(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    source, output = _with_numbers(fixture, tmp_path, "extras"), tmp_path / "out.glb"
    assert call("optimize", source, output, *FAST).code == 0
    assert call("optimize", fixture("noop"), tmp_path / "plain.glb", *FAST).code == 0
    saved = source.stat().st_size - fixture("noop").stat().st_size
    assert output.stat().st_size == pytest.approx((tmp_path / "plain.glb").stat().st_size + saved, abs=4)


def test_keys_that_stay_for_an_unknown_extension_are_said(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    source, output = _with_numbers(fixture, tmp_path, "extensions"), tmp_path / "out.glb"
    kept = "some old keys stay in the file, since unknown extensions may refer to them (/nodes/0/extensions/ACME_ids)"
    run = call("optimize", source, output, *FAST, "--report", "-")
    assert run.json["unchanged_because"] == f"no smaller file within the bound; {kept}"
    assert f"unchanged: no smaller file within the bound; {kept}" in run.err
    limit = source.stat().st_size - 100
    assert kept in refusal(call("optimize", source, output, "--max-bytes", str(limit), *FAST), 6)
