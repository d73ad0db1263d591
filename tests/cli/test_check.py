"""`check`: rules over files and folders, settings, baselines, and reports for CI."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from anim.check.finding import Severity
from anim.check.registry import RULES
from anim.errors import UnsupportedError
from cli.workflows import check_files
from tests.cli.conftest import Call
from tests.cli.running import built
from tests.files import glb_of, opened

LATE = ("GA105", "late-start")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Three files: one with findings, one without, one that is not glTF."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "crowd").mkdir()
    (tmp_path / "noop.glb").write_bytes(built("noop"))
    (tmp_path / "crowd" / "arm 1.glb").write_bytes(built("arm"))
    return tmp_path


def codes(report: Any) -> set[str]:
    return {each["code"] for each in report["findings"]}


def test_findings_are_those_of_inspect_one_per_clip(folder: Path, call: Call) -> None:
    run = call("check", "noop.glb", "--format", "json")
    assert run.code == 0
    found = run.json["findings"]
    inspected = call("inspect", "noop.glb", "--format", "json").json["files"][0]["findings"]
    costly = {"missing-end-frame", "clip-leaves-bounds"}  # those that sample whole clips
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
    assert (run.code, run.text) == (5, "")
    assert problem in run.err


def test_the_exit_code_is_6_from_a_severity_on(folder: Path, call: Call) -> None:
    assert call("check", "noop.glb").code == 0
    run = call("check", "noop.glb", "--fail-on", "info", "-q")
    assert (run.code, run.text) == (6, "")
    assert run.err.startswith("gltf-anim: noop.glb: ")


def test_unreadable_files_exit_3_and_the_others_are_checked(folder: Path, call: Call) -> None:
    for name in ("a.glb", "b.glb"):
        (folder / name).write_bytes(b"no glTF")
    run = call("check", ".", "--format", "json", "--fail-on", "info")
    assert run.code == 3
    assert run.err == "gltf-anim: 2 of 4 files can't be read: a.glb, b.glb\n"
    report = run.json
    assert [each["file"] for each in report["errors"]] == ["a.glb", "b.glb"]
    assert any(each["file"] == "noop.glb" for each in report["findings"])


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
        (("--config", "none.toml"), "there is no such file"),
    ],
)
def test_wrong_options_get_one_line(options: tuple[str, ...], words: str, folder: Path, call: Call) -> None:
    run = call("check", "noop.glb", *options)
    assert run.code in (2, 5)
    assert (run.text, run.err.count("gltf-anim:")) == ("", 1)
    assert words in run.err


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
        ('[check]\nselect = "GA1"\n', "check.select is str (expected list)"),
        ('[check]\nfail-on = "bad"\n', "expected one of error, warning, info"),
        ('[check]\nselect = ["GA999"]\n', "gltf-anim.toml: there is no rule 'GA999'"),
        ('[check]\ntarget = "nobody"\n', "there is no target"),
        ('[[check.files]]\nignore = ["GA1"]\n', "has no match"),
        ("[check\n", "gltf-anim.toml: "),
    ],
)
def test_wrong_settings_are_refused(text: str, words: str, folder: Path, call: Call) -> None:
    (folder / "gltf-anim.toml").write_text(text)
    run = call("check", "noop.glb")
    assert (run.code, run.text) == (2, "")
    assert words in run.err


def test_two_settings_in_one_folder_are_refused(folder: Path, call: Call) -> None:
    (folder / "gltf-anim.toml").write_text("[check]\n")
    (folder / "pyproject.toml").write_text("[tool.gltf-anim]\n")
    assert "expected one of them" in call("check", "noop.glb").err


def test_only_what_is_new_counts_with_a_baseline(folder: Path, call: Call) -> None:
    assert call("check", "noop.glb", "--write-baseline", "known.json", "--fail-on", "info").code == 0
    run = call("check", "noop.glb", "--baseline", "known.json", "--fail-on", "info", "--format", "json")
    assert run.code == 0
    assert run.json["findings"] == []
    run = call("check", "crowd/arm 1.glb", "--baseline", "known.json", "--format", "json")
    assert run.json["gone"]
    (folder / "known.json").write_text("[]")
    run = call("check", "noop.glb", "--baseline", "known.json")
    assert (run.code, run.err) == (3, "gltf-anim: known.json: is no baseline (expected JSON of --write-baseline)\n")


def test_github_shows_ten_of_a_severity_and_escapes_names(folder: Path, call: Call) -> None:
    for i in range(12):
        (folder / f"{i}, a%.glb").write_bytes(built("noop"))
    lines = call("check", ".", "--format", "github", "--select", "GA103").text.splitlines()
    notices = [line for line in lines if line.startswith("::notice")]
    assert len(notices) == 10
    assert notices[0].startswith("::notice file=0%2C a%25.glb,title=GA103 sign-flips::")
    assert "4 more" in notices[-1]


def test_sarif_has_a_region_and_an_encoded_path_in_every_result(folder: Path, call: Call) -> None:
    (folder / "a b#.glb").write_bytes(built("noop"))
    run = call("check", "a b#.glb", "--format", "sarif").json["runs"][0]
    rules = run["tool"]["driver"]["rules"]
    assert run["results"]
    for result in run["results"]:
        place = result["locations"][0]["physicalLocation"]
        assert place == {"artifactLocation": {"uri": "a%20b%23.glb"}, "region": {"startLine": 1}}
        assert rules[result["ruleIndex"]]["id"] == result["ruleId"]
    prints = [result["partialFingerprints"]["gltfAnim/v1"] for result in run["results"]]
    assert len(set(prints)) == len(prints)


def test_junit_has_a_case_per_file(folder: Path, call: Call) -> None:
    (folder / "bad.glb").write_bytes(b"no glTF")
    root = ElementTree.fromstring(call("check", ".", "--format", "junit").text)
    cases = {case.attrib["name"]: [child.tag for child in case] for case in root.iter("testcase")}
    assert cases["bad.glb"] == ["error"]
    assert cases["noop.glb"] == ["system-out"]
    assert root.attrib["tests"] == "3"


def test_markdown_is_a_table_that_names_cannot_break(folder: Path, call: Call) -> None:
    (folder / "a_b [x].glb").write_bytes(built("noop"))
    out = call("check", "a_b [x].glb", "--format", "md", "--select", "GA103").text
    assert "| a\\_b \\[x\\].glb | info | GA103 sign-flips |" in out
    (folder / "<a|b>&.glb").write_bytes(built("noop"))
    out = call("check", "<a|b>&.glb", "--format", "md", "--select", "GA103").text
    assert "| &#60;a&#124;b&#62;&#38;.glb | info |" in out


def test_every_rule_is_listed_and_explained(call: Call) -> None:
    listed = call("check", "--list").text
    for rule in RULES:
        assert f"{rule.code}  {rule.name}" in listed
        text = call("check", "--explain", rule.name).text
        assert text.startswith(f"{rule.code} {rule.name}  [")
        assert rule.about in text
        assert "{" not in text


def test_codes_and_names_of_rules_are_unique_and_severities_ordered() -> None:
    assert len({rule.code for rule in RULES}) == len({rule.name for rule in RULES}) == len(RULES)
    assert Severity.ERROR.is_at_least(Severity.INFO)
    assert not Severity.INFO.is_at_least(Severity.WARNING)


def test_files_are_read_from_stdin(call: Call) -> None:
    run = call("check", "--format", "json", stdin=built("noop"))
    assert run.json["files"] == ["stdin"]


def test_settings_in_the_help_are_toml(call: Call) -> None:
    text = call("check", "--help").text
    settings = tomllib.loads(text[text.index("[check]") : text.index("--write-baseline")])
    assert settings["check"]["fail-on"] == "warning"
    assert settings["check"]["files"] == [{"match": "crowd/**", "ignore": ["GA2"]}]
    assert settings["budget"][0]["bytes"] == 500_000


def test_safe_fixes_change_the_file_in_place_once(folder: Path, call: Call) -> None:
    path = folder / "noop.glb"
    before = path.read_bytes()
    dry = call("check", "noop.glb", "--fix", "--dry-run")
    assert path.read_bytes() == before
    assert "(dry run: nothing written)" in dry.err
    run = call("check", "noop.glb", "--fix", "--format", "json")
    assert not {"GA101", "GA103", "GA104", "GA105"} & codes(run.json)
    assert "fixed" in run.err
    fixed = path.read_bytes()
    assert fixed != before
    (folder / "before.glb").write_bytes(before)
    assert call("diff", "before.glb", "noop.glb", "--fail-above", "0.0001%").code == 0
    again = call("check", "noop.glb", "--fix")
    assert (path.read_bytes(), again.err) == (fixed, "")


def test_unsafe_fixes_need_their_option(folder: Path, call: Call) -> None:
    rename(folder / "noop.glb", ["", "walk", "walk"])
    assert codes(call("check", "noop.glb", "--fix", "--select", "GA0", "--format", "json").json) == {"GA001", "GA002"}
    run = call("check", "noop.glb", "--unsafe-fixes", "--select", "GA0", "--format", "json")
    assert codes(run.json) == set()
    clips = call("inspect", "noop.glb", "--format", "json").json["files"][0]["clips"]
    assert [clip["name"] for clip in clips][:3] == ["animation_0", "walk", "walk_2"]


def rename(path: Path, names: list[str]) -> None:
    document = opened(path.read_bytes())
    for animation, name in zip(document.json["animations"], names, strict=False):
        animation["name"] = name
    path.write_bytes(glb_of(document))


def test_broken_files_and_stdin_are_not_fixed(folder: Path, call: Call) -> None:
    (folder / "bad.glb").write_bytes(b"no glTF")
    assert call("check", "bad.glb", "--fix").code == 3
    assert (folder / "bad.glb").read_bytes() == b"no glTF"
    assert call("check", "-", "--fix", stdin=built("noop")).code == 2


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
    assert found["noop.glb", "clips"].startswith("clips is ")
    table = call("check", "noop.glb", "--budget-report").text
    assert [line.split()[1] for line in table.splitlines()[1:]] == ["bytes", "keys", "clips"]


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
    assert found["invalid"]["advice"] == "correct `against` of [[budget]] in gltf-anim.toml"
    assert str(folder) not in run.text
    assert "noop.glb: source source/noop.glb: can't be read" in run.err


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('match = "*"\nbyte = 3', "did you mean bytes?"),
        ('match = "*"\nbytes = "3 MB"', "budget.bytes is str (expected a number)"),
        ("bytes = 3", "has no match"),
        ('match = "*"\nerror = "1mm"', "has no against"),
    ],
)
def test_wrong_budgets_are_refused(text: str, words: str, folder: Path, call: Call) -> None:
    (folder / "gltf-anim.toml").write_text(f"[[budget]]\n{text}\n")
    run = call("check", "noop.glb")
    assert (run.code, run.text) == (2, "")
    assert words in run.err


def test_a_file_that_cannot_be_fixed_stays_and_the_others_are_fixed(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*args: object, **options: object) -> None:
        raise UnsupportedError("has an extension that names its keys")

    monkeypatch.setattr(check_files, "fix_all", refuse)
    before = (folder / "noop.glb").read_bytes()
    run = call("check", "noop.glb", "--fix", "-q")
    assert (run.code, run.err) == (0, "warning: noop.glb is not fixed: has an extension that names its keys\n")
    assert (folder / "noop.glb").read_bytes() == before
