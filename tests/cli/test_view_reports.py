"""Pages of reports: what they show of a file, and where their findings lead."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Call, Fixture
from tests.cli.running import built, refusal
from tests.cli.test_table import renamed
from tests.cli.test_view import facts
from tests.pages import needs_page


@needs_page
def test_reports_as_pages(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    small = tmp_path / "small.glb"
    run = call(
        "optimize", fixture("biped"), small, "--max-error", "3%", "--effort", "fast", "--html", tmp_path / "o.html"
    )
    assert "o.html  " in run.err
    said = facts((tmp_path / "o.html").read_bytes())
    assert [each["title"] for each in said["panels"]] == ["Size", "Largest errors"]
    assert [each["name"] for each in said["files"]] == ["biped.glb", "small.glb"]
    table = call("diff", fixture("biped"), small, "--html", tmp_path / "d.html").product()
    assert table
    said = facts((tmp_path / "d.html").read_bytes())
    assert said["view"]["show"] == ["heat"]
    assert said["view"]["t"] == said["panels"][0]["rows"][0]["link"]["time"]
    call("inspect", fixture("biped"), "--html", tmp_path / "i.html").product()
    said = facts((tmp_path / "i.html").read_bytes())
    assert [each["title"] for each in said["panels"]] == ["Findings", "Skins", "Contents"]


@needs_page
def test_buttons_name_views_too(call: Call) -> None:
    page = call("view", "-o", "-", "--show", "skeleton,wireframe", stdin=built("arm")).product()
    assert facts(page)["view"]["show"] == ["bones", "wire"]
    assert "did you mean 'curves'?" in call("view", "-o", "-", "--show", "curve", stdin=built("arm")).err


@needs_page
def test_the_page_of_inspect_has_what_its_text_has(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    text = call("inspect", fixture("biped"), "--html", tmp_path / "i.html").product().decode()
    said = facts((tmp_path / "i.html").read_bytes())
    report = json.loads(call("inspect", fixture("biped"), "--format", "json").product())["files"][0]
    assert len(report["clips"]) == len(said["figures"]) > 1
    for clip in report["clips"]:
        row = next(line for line in text.splitlines() if line.split()[:1] == [clip["name"]])
        figures = {each["label"]: each["text"] for each in said["figures"][str(clip["index"])]}
        assert figures["keys"] == str(clip["keys"])
        for label in ("fps", "loop gap", "velocity gap"):
            assert f" {figures[label]}" in row
    rows = said["panels"][0]["rows"]
    assert rows
    assert len(rows) == len(report["findings"])
    advised = {each["advice"].replace(" IN OUT", " biped.glb biped-new.glb") for each in report["findings"]}
    assert {row["advice"] for row in rows} == advised
    assert {row["cells"][0] for row in rows} == {each["name"] for each in report["findings"]}
    assert {row["level"] for row in rows} == {each["severity"] for each in report["findings"]}
    several = next(row for row in rows if "parts" in row)
    assert several["link"] == several["parts"][0]["link"]
    assert len({part["link"]["clip"] for part in several["parts"]}) == len(several["parts"]) > 1


@needs_page
def test_findings_link_to_their_clip_or_node(call: Call, tmp_path: Path) -> None:
    (tmp_path / "a.glb").write_bytes(renamed(built("arm"), ["", "x"]))
    call("inspect", tmp_path / "a.glb", "--html", tmp_path / "i.html").product()
    rows = facts((tmp_path / "i.html").read_bytes())["panels"][0]["rows"]
    assert [row["link"]["clip"] for row in rows if row["cells"][1] == "GA001"] == [0]


@needs_page
def test_findings_lead_to_clip_node_and_time(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    call("inspect", fixture("noop"), "--html", tmp_path / "i.html").product()
    links = {each["cells"][0]: each["link"] for each in facts((tmp_path / "i.html").read_bytes())["panels"][0]["rows"]}
    for name in ("wide-steps", "sign-flips", "end-frame"):
        assert None not in links[name].values()


@needs_page
@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("diff", "a.glb", "--players", "spec,nlerp", "--html", "p.html"), "two files"),
        (("inspect", "-", "--html", "p.html"), "one file with a name"),
        (("inspect", "a.glb", "--html", "p.png"), "no .html file"),
        (("optimize", "a.glb", "b.glb", "--html", "p.html", "--curve", "c.csv"), "--curve"),
        (("bake", "a.glb", "-", "--html", "p.html"), "read again"),
        (("bake", "a.glb", "b.npz", "--up", "z", "--html", "p.html"), "no --up"),
        (("bake", "a.glb", "{clip}.npz", "--html", "p.html"), "one clip and one file, not 2"),
        (("convert-cache", "a.npz", "b.abc", "--html", "p.html"), "reads OUT again"),
    ],
)
def test_pages_that_reports_refuse(
    args: tuple[str, ...], words: str, call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.glb").write_bytes(built("arm"))
    assert words in refusal(call(*args, stdin=built("arm")), 2)
