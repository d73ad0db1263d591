"""`check`: reports for CI systems, and the list of rules."""

from __future__ import annotations

import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
from lxml import etree

from anim.check.baseline import FileFinding
from anim.check.finding import Finding, Severity
from anim.check.registry import RULES
from cli.reports import check_report
from tests.cli.conftest import Call
from tests.cli.running import built
from tests.files import glb_of, opened

SCHEMAS = Path(__file__).parent / "schemas"  # junit-10.xsd: of Jenkins' xunit plugin, MIT license


def test_github_shows_ten_of_a_severity_and_escapes_names(folder: Path, call: Call) -> None:
    for i in range(12):
        (folder / f"{i}, a%.glb").write_bytes(built("noop"))
    lines = call("check", ".", "--format", "github", "--select", "GA103").text.splitlines()
    notices = [line for line in lines if line.startswith("::notice")]
    assert len(notices) == 10
    assert notices[0].startswith("::notice file=0%2C a%25.glb,title=GA103 sign-flips::")
    assert "4 more" in notices[-1]


def test_github_shows_ten_errors_also_of_unreadable_files(folder: Path, call: Call) -> None:
    for i in range(12):
        (folder / f"{i}.glb").write_bytes(b"no glTF")
    lines = call("check", ".", "--format", "github").text.splitlines()
    errors = [line for line in lines if line.startswith("::error")]
    assert len(errors) == 10
    assert errors[0].startswith("::error file=0.glb,title=GA010 invalid::")
    assert errors[-1] == "::error title=gltf-anim::3 more of this severity, see the report of the step"
    call("check", ".", "--write-baseline", "known.json")
    lines = call("check", ".", "--format", "github", "--baseline", "known.json").text.splitlines()
    errors = [line for line in lines if line.startswith("::error")]
    assert errors[0].startswith("::error file=0.glb,title=unreadable::is ")
    assert len(errors) == 10


@pytest.mark.parametrize("content", [b"", b"no glTF", built("noop")[:-4]])
def test_github_shows_one_error_of_a_broken_file(content: bytes, folder: Path, call: Call) -> None:
    (folder / "bad.glb").write_bytes(content)
    lines = call("check", "bad.glb", "--format", "github").text.splitlines()
    (error,) = (line for line in lines if line.startswith("::error"))
    assert error.startswith("::error file=bad.glb,title=GA010 invalid::")


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


@pytest.mark.skipif(sys.platform != "linux", reason="file names of other systems are text")
def test_sarif_encodes_a_name_that_is_no_text(folder: Path, call: Call) -> None:
    (folder / "noop.glb").rename(folder / "\udcff.glb")
    results = call("check", "\udcff.glb", "--format", "sarif", "--fail-on", "info").json["runs"][0]["results"]
    assert {each["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] for each in results} == {"%FF.glb"}


def test_junit_has_a_case_per_file(folder: Path, call: Call) -> None:
    (folder / "bad.glb").write_bytes(b"no glTF")
    root = ElementTree.fromstring(call("check", ".", "--format", "junit").text)
    cases = {case.attrib["name"]: [child.tag for child in case] for case in root.iter("testcase")}
    assert cases["bad.glb"] == ["error"]
    assert cases["noop.glb"] == ["system-out"]
    assert root.attrib["tests"] == "3"


def test_junit_fails_what_fails_the_job(folder: Path, call: Call) -> None:
    """Otherwise a red job has a report without a failure."""
    run = call("check", "noop.glb", "--format", "junit", "--fail-on", "warning")
    root = ElementTree.fromstring(run.text)
    assert (run.code, root.get("failures")) == (6, "1")
    failure = root.find(".//failure")
    assert failure is not None
    assert failure.get("type") == "warning"
    assert "info" not in (failure.text or "")


def test_sarif_stays_within_the_number_of_results_that_github_takes(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cli.reports.check_ci.MAX_RESULTS", 2)
    (run,) = call("check", "noop.glb", "--format", "sarif").json["runs"]
    assert [each["level"] for each in run["results"]] == ["warning", "warning"]
    (invocation,) = run["invocations"]
    assert invocation["executionSuccessful"]
    assert "more findings" in invocation["toolExecutionNotifications"][0]["message"]["text"]


@pytest.mark.parametrize("words", [(".",), ("crowd",), ("bad.glb", "noop.glb", "--select", "GA1")])
def test_junit_agrees_with_the_schema_of_jenkins(words: tuple[str, ...], folder: Path, call: Call) -> None:
    """Files that can't be read, that fail, with other findings only, and with none; names that XML must escape."""
    (folder / "bad.glb").write_bytes(b"no glTF")
    (folder / '<a> & "b" \u0007.glb').write_bytes(built("noop"))
    spoilt = opened(built("arm"))
    spoilt.json["materials"] = []
    (folder / "crowd" / "wrong.glb").write_bytes(glb_of(spoilt))
    (folder / "gltf-anim.toml").write_text('[[budget]]\nmatch = "crowd/*"\nclips = 0\n')
    report = etree.fromstring(call("check", *words, "--format", "junit").out)
    etree.XMLSchema(etree.parse(SCHEMAS / "junit-10.xsd")).assertValid(report)


def test_markdown_is_a_table_that_names_cannot_break(folder: Path, call: Call) -> None:
    (folder / "a_b [x].glb").write_bytes(built("noop"))
    out = call("check", "a_b [x].glb", "--format", "md", "--select", "GA103").text
    assert "| a\\_b \\[x\\].glb | info | GA103 sign-flips |" in out
    (folder / "<a|b>&.glb").write_bytes(built("noop"))
    out = call("check", "<a|b>&.glb", "--format", "md", "--select", "GA103").text
    assert "| &#60;a&#124;b&#62;&#38;.glb | info |" in out


def test_text_has_the_advice_of_every_finding_it_shows() -> None:
    def found(number: int, advice: str) -> FileFinding:
        return "a.glb", Finding("loop-seam", Severity.WARNING, f"clip '{number}'", "jumps", advice, "GA107")

    two = [found(i, f"loop IN OUT --clip '#{i}'") for i in (6, 7)]
    shown = check_report.text(check_report.CheckReport(["a.glb"], two, []))
    assert "--clip '#6'\n" in shown
    assert "--clip '#7'\n" in shown
    same = [found(i, "loop IN OUT") for i in (6, 7)]
    assert check_report.text(check_report.CheckReport(["a.glb"], same, [])).count("loop IN OUT") == 1


def test_every_rule_is_listed_and_explained(call: Call) -> None:
    listed = call("check", "--list").text
    for rule in RULES:
        assert f"{rule.code}  {rule.name}" in listed
        text = call("check", "--explain", rule.name).text
        assert text.startswith(f"{rule.code} {rule.name}  [")
        assert rule.about in text
        assert "{" not in text


def test_junit_counts_a_broken_file_as_an_error_alone(folder: Path, call: Call) -> None:
    (folder / "bad.glb").write_bytes(b"no glTF")
    run = call("check", "bad.glb", "noop.glb", "--format", "junit")
    root = ElementTree.fromstring(run.text)
    assert (root.get("tests"), root.get("failures"), root.get("errors")) == ("2", "0", "1")
    assert len(root.findall(".//error")) == 1
    assert "GA010" in (root.findtext(".//error") or "")


def test_a_quiet_check_shows_what_fails(folder: Path, call: Call) -> None:
    (folder / "gltf-anim.toml").write_text('[[budget]]\nmatch = "**"\nbytes = 1\nkeys = 1\n')
    run = call("check", ".", "-q")
    assert run.code == 6
    listed = [line.split()[:3] for line in run.text.splitlines() if line.startswith("  error")]
    assert listed == [["error", "GA402", "over-budget"]] * 4
    assert "warning" not in run.text
    assert "info" not in run.text
    assert run.err.startswith("gltf-anim: crowd/arm 1.glb: error GA402 over-budget: bytes: ")
    assert call("check", "noop.glb", "-q", "--select", "GA1").text == ""


def test_the_line_on_stderr_is_about_the_worst_finding(folder: Path, call: Call) -> None:
    (folder / "gltf-anim.toml").write_text('[[budget]]\nmatch = "noop.glb"\nbytes = 1\n')
    run = call("check", "noop.glb", "--fail-on", "info")
    assert run.err.startswith("gltf-anim: noop.glb: error GA402 over-budget: bytes: ")


@pytest.mark.parametrize("command", ["check", "inspect"])
def test_a_terminal_shows_an_error_once(
    command: str, folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The line on stderr is for those who redirect the report; where they read both, only its help is new."""
    path = folder / "broken.gltf"
    path.write_text('{"asset": {"version": "2.0"}, "nodes": [{"mesh": 1}]}')
    problem = "is 1 (the file has 0 meshes)"
    apart = call(command, path)
    assert (apart.code, apart.text.count(problem), apart.err.count(problem)) == (3, 1, 1)
    for stream in (sys.stdout, sys.stderr):
        monkeypatch.setattr(stream, "isatty", lambda: True)
    together = call(command, path)
    assert (together.code, together.text, together.err) == (3, apart.text, "")
    quiet = call(command, path, "-q")
    assert (quiet.text + quiet.err).count(problem) == 1
    assert call(command, path, "--format", "json").err.count(problem) == 1
