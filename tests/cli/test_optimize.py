"""`optimize`: smaller animations within a bound, what it says of them, and what it leaves alone."""

from __future__ import annotations

import gzip
import json
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from anim.gltf import read
from anim.gltf.document import Document
from anim.optimize.limits import EFFORTS, Effort
from anim.optimize.seal import KEY
from cli import optimization
from tests.cli.conftest import Call, Find, Fixture
from tests.cli.running import help_line, refusal, shell, table
from tests.cli.untouched import around
from tests.files import glb_of, opened, opened_fixture, opened_path
from tests.khronos import errors, needs_validator, validate_many

FAST = ("--effort", "fast")


def _apart(call: Call, a: Path, b: Path, *options: str) -> dict[str, Any]:
    """What `diff` says of two files."""
    found: dict[str, Any] = call("diff", a, b, "--format", "json", *options).json
    assert (found["missing_clips"], found["added_clips"]) == ([], [])
    return found


def _numbers(content: Any) -> Iterator[float]:
    if isinstance(content, dict):
        content = list(content.values())
    if isinstance(content, list):
        for each in content:
            yield from _numbers(each)
    elif isinstance(content, float):
        yield content


# The bound


@pytest.mark.parametrize("options", [("--drop", "rest"), ("--meshopt", "khr")])
def test_the_file_is_smaller_and_keeps_the_bound(
    options: tuple[str, ...], fixture: Fixture, tmp_path: Path, call: Call
) -> None:
    source, output = fixture("biped"), tmp_path / "out.glb"
    run = call("optimize", source, output, "--max-error", "2mm", *FAST, *options)
    assert (run.code, run.out) == (0, b"")
    assert output.stat().st_size < source.stat().st_size
    for player in ("spec", "three", "raw", "nlerp"):
        assert _apart(call, source, output, "--player", player)["max_error_m"] <= 0.002
    first = run.err.splitlines()[0]
    assert first.startswith(f"{output}  ")
    assert " keys, max " in first
    assert "animation " in first


@pytest.mark.parametrize("name", ["interpolations", "morph_cube", "pointer", "noop", "accessors"])
def test_0_is_without_loss(name: str, fixture: Fixture, tmp_path: Path, call: Call) -> None:
    for zero in ("0", "0%", "0.0mm"):
        run = call("optimize", fixture(name), tmp_path / "out.glb", "--max-error", zero, "--max-pointer-error", "0")
        assert run.code == 0, run.err
    found = _apart(call, fixture(name), tmp_path / "out.glb")
    assert found["max_error_m"] <= 1e-9 * found["diagonal_m"]
    assert all(each["max_pointer_error"] <= 1e-9 for each in found["clips"])


def test_the_default_is_a_hundredth_of_a_percent(fixture: Fixture, call: Call) -> None:
    report = json.loads(call("optimize", fixture("noop"), "-n", "--report", "-").product())
    assert report["bounds"]["max_error_m"] == pytest.approx(1e-4 * report["diagonal_m"])
    assert report["bounds"]["shell_m"] == pytest.approx(1e-2 * report["diagonal_m"])
    assert report["policy"]["effort"] == "balanced"


@pytest.mark.parametrize("name", ["SimpleSkin.gltf", "RiggedSimple.gltf"])
def test_small_real_files(name: str, asset: Find, tmp_path: Path, call: Call) -> None:
    output = tmp_path / "out.glb"
    assert call("optimize", asset(name), output, "--max-error", "0.1%", *FAST).code == 0
    assert _apart(call, asset(name), output, "--player", "three")["max_error_percent"] <= 0.1


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Fox.glb", "MorphStressTest.glb", "Robot.glb", "Knight.glb"])
def test_larger_real_files(name: str, asset: Find, tmp_path: Path, call: Call) -> None:
    output = tmp_path / "out.glb"
    assert call("optimize", asset(name), output, "--max-error", "0.1%", *FAST).code == 0
    for player in ("three", "nlerp"):
        assert _apart(call, asset(name), output, "--player", player)["max_error_percent"] <= 0.1


def test_a_kept_node_stays_exact(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    source, output = fixture("biped"), tmp_path / "out.glb"
    run = call("optimize", source, output, "--max-error", "1%", "--keep-node", "hips", "--clip", "w*", *FAST)
    assert run.code == 0, run.err
    document = opened_path(source)
    number = read.skeleton(document).names.index("hips")
    for old, new in zip(read.clips(document), read.clips(opened_path(output)), strict=True):
        kept = {track.target: track for track in new.tracks if track.node == number}
        for track in old.tracks:
            if track.node == number:
                found = kept[track.target]
                assert set(found.times) <= set(track.times)
                assert (found.values == track.values[[list(track.times).index(t) for t in found.times]]).all()


# What is left alone


@pytest.mark.parametrize("options", [(), ("--meshopt", "ext"), ("--drop", "rest", "--drop-invisible")])
@pytest.mark.parametrize("name", ["noop", "morph_cube", "pointer", "accessors"])
def test_nothing_else_changes(
    name: str, options: tuple[str, ...], fixture: Fixture, tmp_path: Path, call: Call
) -> None:
    """Meshes, skins and images keep their numbers' bytes, though accessors may close up under them."""
    source, output = fixture(name), tmp_path / "out.glb"
    assert call("optimize", source, output, "--max-error", "0.1%", *FAST, *options).code == 0
    old, new = opened_path(source), opened_path(output)
    moving = ("animations", "asset", "meshes", "skins", "images", "extensionsUsed", "extensionsRequired")
    assert around(new.json, *moving) == around(old.json, *moving)
    extras = {**new.json["asset"].get("extras", {})}
    extras.pop(KEY, None)  # none on a file that came back as it was
    assert {**new.json["asset"], "extras": extras or None} == {
        **old.json["asset"],
        "extras": old.json["asset"].get("extras"),
    }
    assert [each.get("name") for each in new.json["animations"]] == [
        each.get("name") for each in old.json["animations"]
    ]
    for a, b in zip(read.scene(old).instances, read.scene(new).instances, strict=True):
        assert (a.node, a.mesh.name) == (b.node, b.mesh.name)
        for part in ("positions", "faces", "joints", "weights", "targets", "rest_weights"):
            assert (getattr(a.mesh, part) == getattr(b.mesh, part)).all(), part
    used = set(new.json.get("extensionsUsed", ())) - set(old.json.get("extensionsUsed", ()))
    assert used <= ({"EXT_meshopt_compression"} if "ext" in options else set())


def test_only_chosen_clips_change(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    source, output = fixture("biped"), tmp_path / "out.glb"
    run = call("optimize", source, output, "--clip", "wave", "--max-error", "0.5%", "-v", *FAST)
    assert [line.split("'")[1] for line in run.err.splitlines() if line.startswith("  clip")] == ["wave"]
    by_name = {each["clip"]: each["max_error_m"] for each in _apart(call, source, output)["clips"]}
    assert by_name.pop("wave") > 0
    assert set(by_name.values()) == {0.0}
    again = call("optimize", output, "-n", "--max-error", "0.5%", *FAST)
    assert "unchanged" not in again.err  # all clips were not optimized before


def test_every_clip_survives(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    source, output = fixture("noop"), tmp_path / "out.glb"
    assert call("optimize", source, output, "--drop", "rest", "--max-error", "50%", *FAST).code == 0
    old, new = (read.clips(opened_path(path)) for path in (source, output))
    assert [(each.name, each.start, each.end) for each in new] == [(each.name, each.start, each.end) for each in old]
    assert all(each.tracks for each in new)


def test_a_dry_run_writes_nothing(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    source = fixture("noop")
    before = {path: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    for options in ((), ("--report", tmp_path / "report.json"), ("--curve", tmp_path / "curve.csv")):
        run = call("optimize", source, tmp_path / "out.glb", "--dry-run", *options, *FAST)
        assert (run.code, run.out) == (0, b"")
        assert ("(dry run: nothing written)" in run.err) is ("--curve" not in options)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.iterdir()} == before


def test_a_gltf_gets_its_bin(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    output = tmp_path / "out.gltf"
    assert call("optimize", fixture("noop"), output, *FAST).code == 0
    assert (tmp_path / "out.bin").is_file()
    assert _apart(call, fixture("noop"), output)["max_error_percent"] <= 0.01


# The same again


@pytest.mark.parametrize(
    "options", [(), ("--meshopt", "khr"), ("--rebase-rest", "--drop", "rest"), ("--max-error", "0")]
)
@pytest.mark.parametrize("name", ["noop", "interpolations", "morph_cube"])
def test_its_own_output_stays_as_it_is(
    name: str, options: tuple[str, ...], fixture: Fixture, tmp_path: Path, call: Call
) -> None:
    once, twice = tmp_path / "once.glb", tmp_path / "twice.glb"
    for source, output in ((fixture(name), once), (once, twice)):
        run = call("optimize", source, output, *FAST, *options)
        assert run.code == 0, run.err
    assert twice.read_bytes() == once.read_bytes()
    assert "unchanged" in run.err


def test_a_file_may_be_its_own_output(fixture: Fixture, call: Call) -> None:
    path = fixture("noop")
    source = path.read_bytes()
    assert call("optimize", path, path, *FAST).code == 0
    assert len(path.read_bytes()) < len(source)


def test_another_bound_on_its_own_output_says_from_where_it_counts(
    fixture: Fixture, tmp_path: Path, call: Call
) -> None:
    once, twice = tmp_path / "once.glb", tmp_path / "twice.glb"
    words = "optimized before; errors are measured from it"
    assert words not in call("optimize", fixture("noop"), once, *FAST).err
    assert words in call("optimize", once, twice, "--max-error", "1%", *FAST).err
    assert words in call("optimize", once, twice, "--max-error", "0", *FAST).err
    assert words not in call("optimize", once, twice, *FAST).err  # unchanged: optimized like this before


def test_never_a_file_that_grew(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    """What is optimized already, under another bound, and so a mark that says so: smaller or just the same."""
    path = fixture("arm")
    for i, bound in enumerate(("0.01%", "0.1%", "0.001%", "0")):
        output = tmp_path / f"{i}.glb"
        assert call("optimize", path, output, "--max-error", bound, *FAST).code == 0
        assert output.stat().st_size <= path.stat().st_size
        path = output


def test_the_same_bytes_for_any_number_of_jobs(
    fixture: Fixture, tmp_path: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(optimization, "LONG", 0)  # several processes, however little there is to do
    for jobs in ("1", "2"):
        run = call("optimize", fixture("noop"), tmp_path / f"{jobs}.glb", "--max-error", "1%", "-j", jobs, *FAST)
        assert run.code == 0, run.err
    assert (tmp_path / "1.glb").read_bytes() == (tmp_path / "2.glb").read_bytes()


# Pipes, reports and curves


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
    old, new = (read.clips(opened_path(path)) for path in (source, output))
    by_clip = {each["clip"]: each for each in _apart(call, source, output)["clips"]}
    assert [each["name"] for each in found["clips"]] == [each.name for each in old]
    for each, a, b in zip(found["clips"], old, new, strict=True):
        assert each["keys_before"] == sum(len(track.times) for track in a.tracks)
        assert each["keys_after"] == sum(len(track.times) for track in b.tracks)
        assert (each["tracks_before"], each["tracks_after"]) == (len(a.tracks), len(b.tracks))
        assert len(each["dropped"]) == len(a.tracks) - len(b.tracks)
        assert {"name", "node", "path"} <= set().union(*each["dropped"], {"name", "node", "path"})
        assert each["end_s"] == a.end
        assert each["mean_m"] <= each["p99_m"] <= each["max_error_m"] * (1 + 1e-9) <= 1e-3 * found["diagonal_m"]
        assert each["max_error_m"] >= by_clip[a.name]["max_error_m"] * (1 - 2e-3)  # that of one player
    assert any(each["dropped"] for each in found["clips"])


def test_the_report_on_stdout_beside_a_file(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    run = call("optimize", fixture("noop"), tmp_path / "out.glb", "--report", "-", *FAST)
    assert run.json["unchanged"] is False
    assert "can't both be stdout" in refusal(call("optimize", fixture("noop"), "--report", "-", *FAST), 2)


def test_words(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    run = call("optimize", fixture("noop"), tmp_path / "out.glb", "--drop", "rest", "-v", *FAST)
    assert "dropped " in run.err
    assert "--drop rest)" in run.err
    lines = [line for line in run.err.splitlines() if line.startswith("  clip ")]
    assert len(lines) == len(read.clips(opened_fixture("noop")))
    assert all(("p99 " in line and "mean " in line) is ("no vertex moved" not in line) for line in lines)
    assert any("p99 " in line for line in lines)
    assert call("optimize", fixture("noop"), tmp_path / "quiet.glb", "-q", *FAST).err == ""
    exact = call("optimize", fixture("biped"), tmp_path / "exact.glb", "--max-error", "0", *FAST).err  # rounding only
    assert ", no vertex moved, " in exact.splitlines()[0]
    assert (tmp_path / "quiet.glb").is_file()


def test_a_curve_as_csv(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    run = call("optimize", fixture("noop"), "--curve", tmp_path / "curve.csv")
    assert (run.code, run.out) == (0, b"")
    rows = table((tmp_path / "curve.csv").read_bytes())
    assert list(rows[0]) == ["max_error_m", "share_of_diagonal", "bytes", "error_m"]
    shares = [float(row["share_of_diagonal"]) for row in rows]
    assert [shares[0], shares[-1]] == pytest.approx([1e-5, 1e-2])
    assert shares == sorted(shares)
    assert all(float(row["error_m"]) <= float(row["max_error_m"]) for row in rows)
    assert int(rows[-1]["bytes"]) < int(rows[0]["bytes"]) < fixture("noop").stat().st_size
    assert len(run.err.splitlines()) == len(rows)


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


# As many bytes as are allowed


def test_the_smallest_error_that_fits(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    source = fixture("noop")
    found = {}
    for percent in ("0", "0.01%", "1%"):
        path = tmp_path / "any.glb"
        assert call("optimize", source, path, "--max-error", percent, *FAST).code == 0
        found[percent] = path.stat().st_size
    limit = (found["0.01%"] + found["1%"]) // 2
    run = call("optimize", source, tmp_path / "fits.glb", "--max-bytes", f"{limit / 1000}kB", "--report", "-", *FAST)
    assert run.code == 0, run.err
    assert (tmp_path / "fits.glb").stat().st_size <= limit
    error = max(each["max_error_m"] for each in run.json["clips"])
    assert 0 < error <= 0.011 * run.json["diagonal_m"]
    roomy = call("optimize", source, tmp_path / "r.glb", "--max-bytes", str(found["0"] + 100), "--report", "-", *FAST)
    assert max(each["max_error_m"] for each in roomy.json["clips"]) <= 1e-9 * roomy.json["diagonal_m"]


def test_a_search_that_ends_elsewhere_still_fits(
    fixture: Fixture, tmp_path: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sizes are tried fast; here the longer search does worse, as chance may have it."""
    assert call("optimize", fixture("noop"), tmp_path / "any.glb", "--max-error", "0.1%", *FAST).code == 0
    limit = (tmp_path / "any.glb").stat().st_size
    monkeypatch.setitem(EFFORTS, "balanced", Effort(1, finishing=()))
    assert call("optimize", fixture("noop"), tmp_path / "out.glb", "--max-bytes", str(limit)).code == 0
    assert (tmp_path / "out.glb").stat().st_size <= limit
    assert call("optimize", tmp_path / "out.glb", tmp_path / "again.glb", "--max-bytes", str(limit)).code == 0
    assert (tmp_path / "again.glb").read_bytes() == (tmp_path / "out.glb").read_bytes()


def test_too_few_bytes(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    run = call("optimize", fixture("arm"), tmp_path / "out.glb", "--max-bytes", "100", *FAST)
    assert "doesn't fit 100 bytes" in refusal(run, 6)
    assert not (tmp_path / "out.glb").exists()
    still = int(re.findall(r"still takes (\d+) bytes", run.err)[0])
    assert call("optimize", fixture("arm"), tmp_path / "out.glb", "--max-error", "10%", *FAST).code == 0
    assert (tmp_path / "out.glb").stat().st_size == still


def test_bytes_and_error_both_count(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    """The size at the bound itself fits, a byte less does not, though a larger error would do."""
    at_bound, output = tmp_path / "bound.glb", tmp_path / "out.glb"
    bound = ("--max-error", "0.01%", "--clip", "wave", *FAST)
    assert call("optimize", fixture("biped"), at_bound, *bound).code == 0
    limit = at_bound.stat().st_size
    assert call("optimize", fixture("biped"), output, "--max-bytes", str(limit), *bound).code == 0
    assert output.stat().st_size <= limit
    assert _apart(call, fixture("biped"), output)["max_error_percent"] <= 0.01
    roomy = call("optimize", fixture("biped"), tmp_path / "no.glb", "--max-bytes", str(limit - 1), *bound[2:])
    assert roomy.code == 0, roomy.err
    (tmp_path / "no.glb").unlink()
    tight = call("optimize", fixture("biped"), tmp_path / "no.glb", "--max-bytes", str(limit - 1), *bound)
    assert f"doesn't fit {limit - 1} bytes" in refusal(tight, 6)
    assert not (tmp_path / "no.glb").exists()


@pytest.mark.parametrize("place", ["in.data", "out.data"])
def test_a_report_takes_no_models_place(place: str, fixture: Fixture, tmp_path: Path, call: Call) -> None:
    """Whatever the models are called; a dry run counts too."""
    source = tmp_path / "in.data"
    source.write_bytes(fixture("arm").read_bytes())
    for dry in ((), ("-n",)):
        run = call("optimize", source, tmp_path / "out.data", "--report", tmp_path / "." / place, *dry, *FAST)
        assert "--report would take the place of a model" in refusal(run, 2)
    assert source.read_bytes() == fixture("arm").read_bytes()
    assert not (tmp_path / "out.data").exists()


# Refusals


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (("--max-error", "-1mm"), "--max-error is '-1mm'"),
        (("--max-error", "3deg"), "--max-error is '3deg'"),
        (("--max-error", ""), "--max-error is ''"),
        (("--max-error", "nan"), "--max-error is 'nan'"),
        (("--shell", "far"), "--shell is 'far'"),
        (("--max-pointer-error", "1mm"), "--max-pointer-error is '1mm'"),
        (("--max-angle", "1"), "--max-angle is '1'"),
        (("--max-speed-error", "0deg"), "--max-speed-error is '0deg'"),
        (("--max-speed-error", "0"), "--max-speed-error is '0'"),
        (("--max-bytes", "many"), "--max-bytes is 'many'"),
        (("--max-bytes", "0"), "--max-bytes is '0'"),
        (("--max-bytes", "-5kB"), "--max-bytes is '-5kB'"),
        (("--drop", "all"), "'all'"),
        (("--effort", "most"), "'most'"),
        (("--meshopt", "draco"), "'draco'"),
        (("--jobs", "-1"), "-1"),
        (("--curve", "c.txt"), "c.txt: is no .csv, .png or .svg file"),
        (("--curve", "nowhere/c.csv"), "there is no folder"),
        (("--report", "nowhere/r.json"), "there is no folder"),
        (("--report", "r.glb"), "r.glb: --report would take the place of a model"),
        (("--curve", "c.csv", "--max-bytes", "1kB"), "--curve goes with neither"),
        (("--curve", "c.csv", "--report", "-"), "--curve goes with neither"),
    ],
)
def test_options_out_of_range(
    options: tuple[str, ...], problem: str, fixture: Fixture, tmp_path: Path, call: Call
) -> None:
    run = call("optimize", fixture("arm"), tmp_path / "out.glb", *options)
    assert problem in refusal(run, 2)
    assert not (tmp_path / "out.glb").exists()


def test_names_that_do_not_exist(fixture: Fixture, call: Call) -> None:
    run = call("optimize", fixture("biped"), "-n", "--clip", "wakl")
    assert "no clip matches 'wakl'" in refusal(run, 5)
    assert help_line(run) == "did you mean 'walk'?"
    assert "no node matches 'hipz'" in refusal(call("optimize", fixture("biped"), "-n", "--keep-node", "hipz"), 5)


def test_bad_files(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    broken = tmp_path / "broken.glb"
    broken.write_bytes(fixture("arm").read_bytes()[:500])
    assert str(broken) in refusal(call("optimize", broken, tmp_path / "out.glb"), 3)
    assert not (tmp_path / "out.glb").exists()
    assert refusal(call("optimize", "-", "-", stdin=b"no glTF"), 3)


def test_a_file_without_clips(tmp_path: Path, call: Call) -> None:
    document = opened_fixture("biped")
    bare = replace(document, json={key: value for key, value in document.json.items() if key != "animations"})
    source, output = tmp_path / "bare.glb", tmp_path / "out.glb"
    source.write_bytes(glb_of(bare))
    assert call("optimize", source, output).code == 0
    assert output.read_bytes() == source.read_bytes()


def test_hidden_vertices_leave_the_nodes(tmp_path: Path, call: Call) -> None:
    """Draco hides vertices; the bound is then kept at the nodes."""
    document = opened_fixture("noop")
    meshes = [
        {**mesh, "primitives": [{**p, "extensions": {"KHR_draco_mesh_compression": {}}} for p in mesh["primitives"]]}
        for mesh in document.json["meshes"]
    ]
    used = {"meshes": meshes, "extensionsUsed": ["KHR_draco_mesh_compression"]}
    source = tmp_path / "hidden.glb"
    source.write_bytes(glb_of(Document({**document.json, **used}, document.buffers)))
    run = call("optimize", source, tmp_path / "out.glb", *FAST)
    assert run.code == 0
    assert "measured at nodes, not on the surface" in run.err


@needs_validator
def test_the_validator_finds_no_new_errors(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    before, after = [], []
    for name in ("arm", "interpolations", "morph_cube", "noop", "pointer", "accessors"):
        for options in ((), ("--meshopt", "ext"), ("--meshopt", "khr", "--rebase-rest")):
            path = tmp_path / "out.glb"
            assert call("optimize", fixture(name), path, "--max-error", "0.1%", *FAST, *options).code == 0
            before.append(fixture(name).read_bytes())
            after.append(path.read_bytes())
            assert opened(after[-1]).json["animations"]
    reports = validate_many([*before, *after])
    for old, new in zip(reports[: len(before)], reports[len(before) :], strict=True):
        assert set(errors(new)) <= set(errors(old))
