"""`check`: settings, budgets and baselines."""

from __future__ import annotations

import os
import re
import sys
import tomllib
from pathlib import Path

import pytest

from tests.cli.checking import codes
from tests.cli.conftest import Call
from tests.cli.running import refusal


def test_settings_come_from_the_nearest_file_upwards(folder: Path, call: Call) -> None:
    (folder / "gltf-anim.toml").write_text(
        '[check]\nselect = ["GA1"]\nfail-on = "info"\nparams = {"GA109.regular" = 0.5}\n'
        '[[check.files]]\nmatch = "noop.*"\nignore = ["GA103"]\n'
    )
    run = call("check", "noop.glb", "--format", "json")
    assert run.code == 6
    assert "GA103" not in codes(run.json)
    (folder / "crowd" / "pyproject.toml").write_text('[tool.gltf-anim.check]\nignore = ["ALL"]\n')
    assert call("check", "crowd", "--fail-on", "info").code == 0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[check]\nselct = []\n", "unknown key 'check.selct'"),
        ("[checks]\n", "did you mean check?"),
        ('[check]\nselect = "GA1"\n', "check.select is 'GA1' (expected a list)"),
        ('[check]\nfail-on = "bad"\n', "expected one of error, warning, info"),
        ('[check]\nselect = ["GA999"]\n', "gltf-anim.toml: there is no rule 'GA999'"),
        ('[check]\ntarget = "nobody"\n', "there is no target"),
        ('[[check.files]]\nignore = ["GA1"]\n', "has no match"),
        ("[check\n", "gltf-anim.toml: "),
        (f"check{'.a' * 3000} = 1\n", "gltf-anim.toml: is nested too deep"),
        (f'[[budget]]\nmatch = "*"\nbytes = {"9" * 6000}\n', "number of thousands of digits (TOML has 64 bits)"),
        (f'[[budget]]\nmatch = "*"\nbytes = {"9" * 4000}\n', "budget.bytes is a whole number that TOML can't hold"),
        (f"[check]\nselect = 0x{'f' * 6000}\n", "check.select is a whole number that TOML can't hold"),
        (f'[check]\nparams = {{"GA109.regular" = [0x{"f" * 6000}]}}\n', "check.params.GA109.regular is a whole number"),
        ('[[budget]]\nmatch = "*"\nerror = "1mm"\nagainst = "a\\u0000b"\n', "against of [[budget]] has a null"),
    ],
    ids=lambda text: text[:60],
)
def test_wrong_settings_are_refused(text: str, words: str, folder: Path, call: Call) -> None:
    (folder / "gltf-anim.toml").write_text(text)
    run = call("check", "noop.glb")
    assert (run.code, run.text) == (2, "")
    assert words in run.err
    assert "sys." not in run.err


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no named pipes")
@pytest.mark.parametrize("against", ["fifo", "/dev/zero", "crowd", "x" * 5000])
def test_sources_of_budgets_are_regular_files(against: str, folder: Path, call: Call) -> None:
    """A check waited for a writer of the pipe."""
    os.mkfifo(folder / "fifo")
    (folder / "gltf-anim.toml").write_text(f'[[budget]]\nmatch = "*"\nerror = "1mm"\nagainst = "{against}"\n')
    run = call("check", "noop.glb", "--format", "json")
    assert run.code == 3
    assert run.json["findings"] is not None
    words = {"crowd": "is a folder", "x" * 5000: "name too long"}
    assert words.get(against, "is no regular file") in run.err


@pytest.mark.parametrize(
    ("kind", "code", "words"),
    [
        ("fifo", 3, "is no regular file"),
        ("/dev/zero", 3, "is no regular file"),
        ("folder", 3, "can't be read (is a directory)"),
        ("gltf-anim.toml", 3, "can't be read (too many levels of symbolic links)"),
        ("long", 4, "has more than 1 MB"),
    ],
)
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no named pipes")
@pytest.mark.parametrize("command", ["check", "run"])
def test_settings_are_a_short_regular_file(
    command: str, kind: str, code: int, words: str, folder: Path, call: Call
) -> None:
    """A pipe was waited for, and a device was read until memory ended."""
    path = folder / "gltf-anim.toml"
    if kind == "fifo":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    elif kind == "long":
        path.write_bytes(b"#" * 1_000_001)
    else:
        path.symlink_to(kind)
    assert f"gltf-anim.toml: {words}" in refusal(call(command, "noop.glb"), code)
    assert f"gltf-anim.toml: {words}" in refusal(call(command, "noop.glb", "--config", path), code)


@pytest.mark.parametrize("command", ["check", "run"])
def test_named_settings_that_are_not_there_are_a_missing_file(command: str, folder: Path, call: Call) -> None:
    refused = refusal(call(command, "noop.glb", "--config", "none.toml"), 3)
    assert refused == "gltf-anim: none.toml: can't be read (no such file or directory)"
    (folder / "pyproject.toml").write_text("[tool.other]\n")
    refused = refusal(call(command, "noop.glb", "--config", "pyproject.toml"), 2)
    assert refused == "gltf-anim: pyproject.toml: has no [tool.gltf-anim]"


def test_two_settings_in_one_folder_are_refused(folder: Path, call: Call) -> None:
    (folder / "gltf-anim.toml").write_text("[check]\n")
    (folder / "pyproject.toml").write_text("[tool.gltf-anim]\n")
    assert "expected one of them" in call("check", "noop.glb").err


@pytest.mark.parametrize(
    ("name", "problem", "code"),
    [
        ("crowd/../noop.glb", "--write-baseline would replace an input", 2),
        ("none/a.json", "there is no folder", 3),
    ],
)
def test_a_baseline_replaces_no_checked_file(name: str, problem: str, code: int, folder: Path, call: Call) -> None:
    before = (folder / "noop.glb").read_bytes()
    assert problem in refusal(call("check", "noop.glb", "--write-baseline", name), code)
    assert (folder / "noop.glb").read_bytes() == before


def test_only_what_is_new_counts_with_a_baseline(folder: Path, call: Call) -> None:
    assert call("check", "noop.glb", "--write-baseline", "known.json", "--fail-on", "info").code == 0
    run = call("check", "noop.glb", "--baseline", "known.json", "--fail-on", "info", "--format", "json")
    assert run.code == 0
    assert run.json["findings"] == []
    run = call("check", "crowd/arm 1.glb", "--baseline", "known.json", "--format", "json")
    assert run.json["gone"] == {}  # as noop.glb is not checked
    (folder / "noop.glb").unlink()
    run = call("check", "crowd/arm 1.glb", "--baseline", "known.json", "--format", "json")
    assert run.json["gone"]
    (folder / "known.json").write_text("[]")
    run = call("check", "crowd", "--baseline", "known.json")
    assert (run.code, run.err) == (3, "gltf-anim: known.json: is no baseline (expected JSON of --write-baseline)\n")


def test_a_baseline_keeps_what_it_knows_of_files_that_are_not_checked(folder: Path, call: Call) -> None:
    call("check", ".", "--write-baseline", "known.json")
    before = (folder / "known.json").read_text()
    (folder / "noop.glb").rename(folder / "b: noop.glb")
    call("check", ".", "--write-baseline", "known.json")
    renamed = (folder / "known.json").read_text()
    assert renamed.replace("b: noop.glb", "noop.glb") == before  # without a line of the old name
    run = call("check", "crowd", "--write-baseline", "known.json")
    assert (folder / "known.json").read_text() == renamed
    assert "kept of files that were not checked" in run.err
    run = call("check", "crowd", "--baseline", "known.json", "--format", "json")
    assert (run.json["findings"], run.json["gone"]) == ([], {})
    (folder / "b: noop.glb").unlink()
    call("check", "crowd", "--write-baseline", "known.json")
    assert "noop.glb" not in (folder / "known.json").read_text()


def test_settings_in_the_help_are_toml(call: Call) -> None:
    text = call("check", "--help").text
    settings = tomllib.loads(text[text.index("[check]") : text.index("--write-baseline")])
    assert settings["check"]["fail-on"] == "warning"
    assert settings["check"]["files"] == [{"match": "crowd/**", "ignore": ["GA2"]}]
    assert settings["budget"][0]["bytes"] == 500_000


def test_budgets_are_limits_for_matching_files(folder: Path, call: Call) -> None:
    assert call("resample", "noop.glb", "coarse.glb", "--fps", "2").code == 0
    (folder / "gltf-anim.toml").write_text(
        '[[budget]]\nmatch = "noop.*"\nclips = 3\nbytes = 1_000_000\nkeys = 100_000\n'
        '[[budget]]\nmatch = "coarse.*"\nerror = "1mm"\nagainst = "noop.glb"\n'
        '[[budget]]\nmatch = "none/**"\nbytes = 1\n'
    )
    run = call("check", ".", "--format", "json", "--select", "GA402")
    assert run.code == 6
    assert "the budget 'none/**' matches no checked file" in run.err
    found = {(each["file"], each["where"]): each["problem"] for each in run.json["findings"]}
    assert set(found) == {("noop.glb", "clips"), ("coarse.glb", "error")}
    assert found["noop.glb", "clips"].endswith("above the limit of 3 (300 %) in budget 1 of gltf-anim.toml")
    assert found["coarse.glb", "error"].endswith(" in budget 2 of gltf-anim.toml")
    assert "matches no checked file" not in call("check", "noop.glb").err
    table = call("check", "noop.glb", "--budget-report").text
    assert [line.split()[1] for line in table.splitlines()[1:]] == ["bytes", "keys", "clips"]
    rows = call("check", "noop.glb", "--budget-report", "--format", "json").json["budgets"]
    assert [(each["file"], each["budget"]) for each in rows] == [
        ("noop.glb", each) for each in ("bytes", "keys", "clips")
    ]
    assert rows[2]["value"] > rows[2]["limit"] == 3
    assert "--format md" in refusal(call("check", "noop.glb", "--budget-report", "--format", "md"), 2)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('match = "*"\nbyte = 3', "did you mean bytes?"),
        ('match = "*"\nbytes = "2 pounds"', "budget.bytes is '2 pounds' (expected a size like 800kB, 1.5MB or 65536)"),
        ('match = "*"\nkeys = "2kB"', "budget.keys is '2kB' (expected a number)"),
        ('match = "*"\nbytes = nan', "budget.bytes is nan (expected a finite number)"),
        ("bytes = 3", "has no match"),
        ('match = "*"\nerror = "1mm"', "has no against"),
        ('match = "*"\nerror = "1mm"\nagainst = "a/{file}"', "{file} stands for nothing (expected {path} or"),
        ('match = "*"\nerror = "1mm"\nagainst = "{path}"', "is the checked file itself: noop.glb"),
        ('match = "*"\nerror = "1mm"\nagainst = "{folder}/{name}"', "is the checked file itself: noop.glb"),
    ],
)
def test_wrong_budgets_are_refused(text: str, words: str, folder: Path, call: Call) -> None:
    (folder / "gltf-anim.toml").write_text(f"[[budget]]\n{text}\n")
    run = call("check", "noop.glb")
    assert (run.code, run.text) == (2, "")
    assert words in run.err


@pytest.mark.parametrize(
    ("match", "against"),
    [
        ("build/**", "{subfolder}/{stem}.gltf"),
        ("build/**/*.glb", "{subfolder}/{stem}.gltf"),
        ("build/art/*.glb", "art/{subfolder}/{stem}.gltf"),
        ("**/*.glb", "{subfolder}/../../art/{stem}.gltf"),
    ],
)
def test_sources_of_outputs_in_another_folder(match: str, against: str, folder: Path, call: Call) -> None:
    for name in ("art", "build/art"):
        (folder / name).mkdir(parents=True)
    assert call("convert", "noop.glb", "art/noop.gltf").code == 0
    assert call("resample", "noop.glb", "build/art/noop.glb", "--fps", "2").code == 0
    (folder / "gltf-anim.toml").write_text(f'[[budget]]\nmatch = "{match}"\nerror = "1mm"\nagainst = "{against}"\n')
    run = call("check", "build", "--format", "json", "--select", "GA402")
    assert (run.code, [each["where"] for each in run.json["findings"]]) == (6, ["error"])


def test_a_baseline_is_the_same_from_every_folder(folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    call("check", ".", "--write-baseline", "known.json")
    monkeypatch.chdir(folder / "crowd")
    run = call("check", "..", "--baseline", "../known.json", "--format", "json", "--fail-on", "info")
    assert (run.code, run.json["findings"], run.json["gone"]) == (0, [], {})


def test_sizes_of_budgets_take_units(folder: Path, call: Call) -> None:
    size = (folder / "noop.glb").stat().st_size
    for limit, code in ((f"{size / 1e3}kB", 0), (f"{size / 1e3 - 0.001:.3f} kB", 6)):
        (folder / "gltf-anim.toml").write_text(f'[[budget]]\nmatch = "noop.glb"\nbytes = "{limit}"\n')
        assert call("check", "noop.glb").code == code


def test_a_budget_behind_one_of_the_same_pattern_counts_nothing(folder: Path, call: Call) -> None:
    twice = '[[budget]]\nmatch = "*.glb"\nclips = 9\n' * 2
    (folder / "gltf-anim.toml").write_text(twice.replace("clips = 9", "keys = 100000", 1))
    assert "the budget '*.glb' has the pattern of an earlier one, which counts" in call("check", ".").err


def test_quiet_shows_every_finding_that_fails(folder: Path, call: Call) -> None:
    whole, quiet = (call("check", "noop.glb", "--fail-on", "info", *more) for more in ((), ("-q",)))
    assert (whole.code, quiet.code) == (6, 6)
    in_quiet, in_all = (set(re.findall(r"^  \w+ +(GA\d{3})", run.text, re.MULTILINE)) for run in (quiet, whole))
    assert in_quiet == in_all != set()


def test_no_budget_is_said(folder: Path, call: Call) -> None:
    assert call("check", "noop.glb", "--budget-report").text == "no checked file has a budget\n"


def test_the_exit_code_of_a_budget_report_is_in_the_help(folder: Path, call: Call) -> None:
    (folder / "gltf-anim.toml").write_text('[[budget]]\nmatch = "noop.glb"\nbytes = 1\n')
    assert call("check", "noop.glb", "--budget-report").code == 0
    assert "exit 0 above them too" in " ".join(call("check", "--help").text.split())


def test_settings_that_are_no_text_are_refused(folder: Path, call: Call) -> None:
    (folder / "gltf-anim.toml").write_bytes(b"glTF\x02\x00\x00\x00\x88")
    run = call("check", "noop.glb")
    assert run.code == 2
    assert "gltf-anim.toml: is no TOML: byte 8 is not UTF-8" in run.err


@pytest.mark.parametrize("text", [f"{'a.' * 20_000}a = 1", f"[{'a.' * 2000}a]\n" + "b = 1\n" * 10_000])
@pytest.mark.parametrize("command", ["check", "run"])
def test_keys_of_thousands_of_parts_are_refused_before_they_are_read(
    command: str, text: str, folder: Path, call: Call
) -> None:
    (folder / "gltf-anim.toml").write_text(text)
    assert "gltf-anim.toml: has lines of thousands of dots" in refusal(call(command, "noop.glb"), 4)


def test_texts_of_thousands_of_dots_are_read(folder: Path, call: Call) -> None:
    names = [f"v1.2.{i}" for i in range(3000)]
    (folder / "pyproject.toml").write_text(f"[project]\nnames = {names}\n[tool.gltf-anim]\nx = 1\n")
    assert "unknown key 'x'" in refusal(call("check", "noop.glb"), 2)
