"""`optimize`: what it refuses, and what the validator says of what it writes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.cli.conftest import Call, Fixture
from tests.cli.running import help_line, refusal
from tests.files import glb_of, opened, opened_fixture
from tests.khronos import errors, needs_validator, validate_many

FAST = ("--effort", "fast")


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


@pytest.mark.parametrize("options", [("--curve", "nowhere/c.csv"), ("--report", "nowhere/r.json")])
def test_a_missing_folder_is_named_before_any_work(options: tuple[str, ...], tmp_path: Path, call: Call) -> None:
    run = call("optimize", tmp_path / "lost.glb", tmp_path / "out.glb", *options)
    assert "there is no folder 'nowhere'" in refusal(run, 3)


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
    for options in ((), ("--max-bytes", "1MB")):
        run = call("optimize", source, output, *options)
        assert (run.code, run.err.rstrip().endswith(", unchanged: it has no clips")) == (0, True), run.err
    assert output.read_bytes() == source.read_bytes()
    said = refusal(call("optimize", source, output, "--max-bytes", "1kB"), 6)
    assert said.endswith("and has no clips that could take fewer; nothing was written")


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


@pytest.mark.parametrize("place", ["in", "out"])
def test_a_report_takes_no_models_place(place: str, fixture: Fixture, tmp_path: Path, call: Call) -> None:
    """Also where the models' names have no ending; a dry run counts too."""
    source = tmp_path / "in"
    source.write_bytes(fixture("arm").read_bytes())
    for dry in ((), ("-n",)):
        run = call("optimize", source, tmp_path / "out", "--report", tmp_path / "." / place, *dry, *FAST)
        assert f"--report would replace {'OUT' if place == 'out' else 'an input'}" in refusal(run, 2)
    assert source.read_bytes() == fixture("arm").read_bytes()
    assert not (tmp_path / "out").exists()
