"""`check`: rules over files and folders."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from anim.check.finding import Severity
from anim.check.registry import RULES
from tests.cli.checking import codes
from tests.cli.conftest import Call
from tests.cli.running import built


def test_findings_are_those_of_inspect_one_per_clip(folder: Path, call: Call) -> None:
    run = call("check", "noop.glb", "--format", "json")
    assert run.code == 0
    found = run.json["findings"]
    inspected = call("inspect", "noop.glb", "--format", "json").json["files"][0]["findings"]
    costly = {"clip-leaves-bounds"}  # those that sample whole clips
    assert {each["name"] for each in found} - costly == {each["name"] for each in inspected}
    flips = [each for each in found if each["name"] == "sign-flips"]
    assert [each["where"] for each in flips] == ["clip 'signs'"]
    assert flips[0]["pointer"].startswith("/animations/")
    assert flips[0]["fingerprint"] == "GA103:noop.glb:clip 'signs'"


def test_folders_and_patterns_are_searched(folder: Path, call: Call) -> None:
    for words in ((".",), ("**/*.glb",), ("crowd", "noop.glb", "noop.glb")):
        files = call("check", *words, "--format", "json").json["files"]
        assert sorted(files) == ["crowd/arm 1.glb", "noop.glb"]


@pytest.mark.parametrize(("word", "problem"), [("*.gltf", "matches no file"), ("empty", "has no .glb")])
def test_a_pattern_or_folder_without_files_is_an_error(word: str, problem: str, folder: Path, call: Call) -> None:
    (folder / "empty").mkdir()
    run = call("check", word)
    assert (run.code, run.text) == (3, "")  # as for "none.gltf"
    assert problem in run.err


def test_the_exit_code_is_6_from_a_severity_on(folder: Path, call: Call) -> None:
    assert call("check", "noop.glb").code == 0
    run = call("check", "noop.glb", "--fail-on", "info", "-q")
    assert run.code == 6
    assert run.text.startswith("noop.glb\n")
    assert run.err.startswith("gltf-anim: noop.glb: ")
    assert run.err.endswith(" more\n")
    (folder / "again.glb").write_bytes((folder / "noop.glb").read_bytes())
    many = call("check", "noop.glb", "again.glb", "--fail-on", "info", "-q").err
    assert re.search(r"; (\d+) findings in 2 files: noop.glb (\d+), again.glb \2$", many.rstrip())
    assert " findings in 2 files: " in call("inspect", "noop.glb", "again.glb", "--fail-on", "info", "-q").err


def test_unreadable_files_exit_3_and_the_others_are_checked(folder: Path, call: Call) -> None:
    for name in ("a.glb", "b.glb"):
        (folder / name).write_bytes(b"no glTF")
    run = call("check", ".", "--format", "json", "--fail-on", "info")
    assert run.code == 3
    assert run.err == "gltf-anim: 2 of 4 files can't be read: a.glb, b.glb\n"
    report = run.json
    assert [each["file"] for each in report["errors"]] == ["a.glb", "b.glb"]
    assert any(each["file"] == "noop.glb" for each in report["findings"])


def test_parameters_and_targets_change_findings(folder: Path, call: Call) -> None:
    def severity(*options: str) -> str:
        found = call("check", "late.glb", "--format", "json", "--select", "GA105", *options).json["findings"]
        return str(found[0]["severity"])

    (folder / "arm.glb").write_bytes(built("arm"))
    assert call("retime", "arm.glb", "late.glb", "--offset", "0.5").code == 0
    assert (severity(), severity("--target", "unity")) == ("info", "warning")
    found = codes(call("check", "noop.glb", "--format", "json", "--param", "GA109.regular=0").json)
    assert "GA109" not in found


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--select", "wide-step"), "did you mean wide-steps?"),
        (("--select", "GA999"), "there is no rule 'GA999'"),
        (("--explain", "GA10"), "there is no rule 'GA10'"),
        (("--param", "GA201.influence=3"), "parameters of GA201 many-influences: GA201.influences"),
        (("--param", "GA201.influences=many"), "expected a number like 4"),
        (("--param", "GA201.influences"), "expected RULE.NAME=VALUE"),
        (("--baseline", "a", "--write-baseline", "b"), "can't be combined"),
    ],
)
def test_wrong_options_get_one_line(options: tuple[str, ...], words: str, folder: Path, call: Call) -> None:
    run = call("check", "noop.glb", *options)
    assert run.code in (2, 5)
    assert (run.text, run.err.count("gltf-anim:")) == ("", 1)
    assert words in run.err


def test_codes_and_names_of_rules_are_unique_and_severities_ordered() -> None:
    assert len({rule.code for rule in RULES}) == len({rule.name for rule in RULES}) == len(RULES)
    assert Severity.ERROR.is_at_least(Severity.INFO)
    assert not Severity.INFO.is_at_least(Severity.WARNING)


def test_files_are_read_from_stdin(call: Call) -> None:
    run = call("check", "--format", "json", stdin=built("noop"))
    assert run.json["files"] == ["stdin"]


def test_an_empty_stdin_without_a_name_has_a_hint(call: Call) -> None:
    run = call("check", stdin=b"")
    problem, help = run.err.splitlines()
    assert (run.code, problem) == (3, "gltf-anim: stdin: is empty (expected glTF)")
    assert help == "help: without FILE, stdin is read; for all files below this folder: gltf-anim check ."
    assert "help:" not in call("check", "-", stdin=b"").err
    assert "'-' or none: stdin" in " ".join(call("check", "--help").text.split())


def test_a_missing_source_leaves_the_other_findings_and_limits(folder: Path, call: Call) -> None:
    (folder / "gltf-anim.toml").write_text(
        '[[budget]]\nmatch = "noop.glb"\nclips = 3\nerror = "1mm"\nagainst = "source/{path}"\n'
    )
    run = call("check", "noop.glb", "--format", "json")
    assert run.code == 3
    found = {each["name"]: each for each in run.json["findings"]}
    assert {"over-budget", "no-effect-tracks"} <= set(found)
    assert found["invalid"]["where"] == "source source/noop.glb"
    assert found["invalid"]["problem"] == "can't be read (no such file or directory)"
    assert found["invalid"]["advice"] == "correct `against` in budget 1 of gltf-anim.toml"
    assert str(folder) not in run.text
    assert "noop.glb: source source/noop.glb: can't be read" in run.err


def test_only_the_sources_that_cannot_be_read_are_counted_as_sources(folder: Path, call: Call) -> None:
    text = '[[budget]]\nmatch = "{}"\nerror = "1mm"\nagainst = "source/{{name}}"\n'
    (folder / "gltf-anim.toml").write_text(text.format("noop.glb") + text.format("crowd/*"))
    run = call("check", ".")
    assert run.code == 3
    assert run.err == "gltf-anim: the sources of 2 of 2 files can't be read: crowd/arm 1.glb, noop.glb\n"
    assert run.text.splitlines()[-1].endswith("; 2 sources unreadable")
    (folder / "a.glb").write_bytes(b"no glTF")
    problem = "1 of 3 files can't be read: a.glb; the sources of 2 of 3 files can't be read: crowd/arm 1.glb, noop.glb"
    assert call("check", ".").err == f"gltf-anim: {problem}\n"


def test_sources_of_budgets_are_not_checked_themselves_unless_they_are_named(folder: Path, call: Call) -> None:
    (folder / "source").mkdir()
    (folder / "source" / "noop.glb").write_bytes(built("noop"))
    (folder / "source" / "other.glb").write_bytes(built("arm"))
    budget = '[[budget]]\nmatch = "noop.glb"\nerror = "1mm"\nagainst = "source/{path}"\n'
    (folder / "gltf-anim.toml").write_text(budget)
    files = call("check", ".", "--format", "json").json["files"]
    assert sorted(files) == ["crowd/arm 1.glb", "noop.glb", "source/other.glb"]
    assert call("check", "source/noop.glb", "--format", "json").json["files"] == ["source/noop.glb"]
    (folder / "gltf-anim.toml").write_text(budget.replace("source/{path}", "noop.glb"))
    assert "noop.glb" in call("check", ".", "--format", "json").json["files"]


@pytest.mark.parametrize(
    ("options", "kept"),
    [
        (("--select", "GA103"), {"GA103"}),
        (("--select", "sign-flips,GA112"), {"GA103", "GA112"}),
        (
            ("--select", "GA1", "--ignore", "GA103,GA101,GA102"),
            {"GA104", "GA105", "GA106", "GA107", "GA108", "GA111", "GA113"},
        ),
    ],
)
def test_rules_are_selected_by_code_prefix_and_name(
    options: tuple[str, ...], kept: set[str], folder: Path, call: Call
) -> None:
    found = codes(call("check", "noop.glb", "--format", "json", *options).json)
    assert found == kept & found
    assert found


def test_advice_on_a_missing_file_is_about_its_name(folder: Path, call: Call) -> None:
    run = call("check", "none.glb")
    assert run.code == 3
    assert "correct its name" in run.text
    assert "where the file is made" not in run.text
    (folder / "file").write_text("")
    assert "there is no folder 'file'" in call("check", "file/none.glb").text  # its settings are those above
