"""`view`: pages of files, pipes, caches and curves, of one file or two; without any network."""

from __future__ import annotations

import base64
import gzip
import hashlib
import html
import json
import re
import threading
import urllib.error
import urllib.request
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import fixtures
from anim.gltf.reading.reader import scene
from anim.show.page import resources
from cli.io import browser
from cli.reports.bake_notes import only_baked_words
from tests.anim.caches.making import cache, written
from tests.cli.conftest import Call, Fixture
from tests.cli.running import built, refusal
from tests.cli.test_table import BVH, CURVES, renamed
from tests.files import glb_of, opened_fixture
from tests.fixtures.reading import split
from tests.pages import needs_page

MARKUP = "</script><script>alert(1)</script><img src=x onerror=alert(2)>"


def facts(page: bytes) -> Any:
    """What a page says about its files."""
    found = re.search(rb'id="facts">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    return json.loads(found[1])


def embedded(page: bytes, name: str = "a") -> bytes:
    """The GLB in a page."""
    found = re.search(rf'id="{name}">(.*?)</script>'.encode(), page, re.DOTALL)
    assert found is not None
    return gzip.decompress(base64.b64decode(found[1]))


@needs_page
def test_a_page_of_a_file(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    run = call("view", fixture("biped"), "-o", tmp_path / "a.html", "--clip", "wave", "--at", "0.5", "--show", "bones")
    assert run.out == b""
    assert "a.html  " in run.err
    page = (tmp_path / "a.html").read_bytes()
    said = facts(page)
    assert [each["name"] for each in said["files"]] == ["biped.glb"]
    assert said["view"] == {"clip": "wave", "t": 0.5, "show": ["bones"]}
    assert split(embedded(page))[0]["animations"]
    assert embedded(page, "code").startswith(b"(()=>") or b"three" in embedded(page, "code").lower()


@needs_page
def test_the_same_input_gives_the_same_page(call: Call) -> None:
    one = call("view", "-o", "-", stdin=built("arm")).product()
    assert call("view", "-", "--out", "-", stdin=built("arm")).product() == one


@needs_page
def test_nothing_runs_but_two_scripts_and_nothing_is_loaded(call: Call) -> None:
    page = call("view", "-o", "-", stdin=built("arm")).product().decode()
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page)
    assert policy is not None
    assert "default-src 'none'" in policy[1]
    assert "http" not in policy[1]
    assert "unsafe-eval" not in policy[1].replace("wasm-unsafe-eval", "")
    start = page.rpartition("<script>")[2].partition("</script>")[0].encode()
    for script in (start, embedded(page.encode(), "code")):
        assert f"'sha256-{base64.b64encode(hashlib.sha256(script).digest()).decode()}'" in policy[1]
    assert not re.search(r'(src|href)="', page.partition("<script")[0])


@needs_page
def test_names_with_markup_stay_text(call: Call, tmp_path: Path) -> None:
    (tmp_path / "a.glb").write_bytes(renamed(built("arm"), [MARKUP, MARKUP]))
    page = call("view", tmp_path / "a.glb", "-o", "-", "--title", MARKUP, "--clip", "*script*").product().decode()
    assert "alert(1)</script>" not in page
    assert "<img src=x" not in page
    assert html.escape(MARKUP) in page
    assert facts(page.encode())["view"]["clip"] == MARKUP


@needs_page
def test_two_files_with_errors_over_time(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    small = tmp_path / "small.glb"
    call("optimize", fixture("biped"), small, "--max-error", "3%", "--effort", "fast")
    run = call("view", fixture("biped"), small, "-o", tmp_path / "ab.html")
    said = facts((tmp_path / "ab.html").read_bytes())
    worst = max(each["max"] for each in said["errors"].values())
    report = json.loads(call("diff", fixture("biped"), small, "--format", "json", "--shell", "0").product())
    assert worst == pytest.approx(report["max_error_m"], rel=1e-3)
    first = said["panels"][0]["rows"][0]["link"]
    curve = said["errors"][str(first["clip"])]
    assert max(curve["errors"]) == pytest.approx(worst, rel=1e-3)
    assert first["time"] == pytest.approx(curve["times"][curve["errors"].index(max(curve["errors"]))], abs=1e-3)
    clip = split(embedded((tmp_path / "ab.html").read_bytes()))[0]["animations"][first["clip"]]["name"]
    assert f"in '{clip}' at '" in run.err
    assert f"', {first['time']:.3f} s, took" in run.err
    assert "diff also measures a small shell" in said["panels"][0]["about"]


@needs_page
def test_caches_and_curves(call: Call, tmp_path: Path) -> None:
    (tmp_path / "a.npz").write_bytes(written(cache(), "a.npz")[0].files["a.npz"])
    (tmp_path / "walk.bvh").write_text(BVH)
    (tmp_path / "door.json").write_bytes(_curves(call, tmp_path))
    for name in ("a.npz", "walk.bvh", "door.json"):
        page = call("view", tmp_path / name, "-o", "-").product()
        assert split(embedded(page))[0]["animations"]
    assert facts(call("view", "-o", "-", stdin=BVH.encode()).product())["files"][0]["notes"]


def _curves(call: Call, folder: Path) -> bytes:
    """Curves in JSON, which state their convention."""
    (folder / "door.csv").write_text(CURVES)
    options = ("--order", "XYZ", "--axes", "extrinsic", "--unit", "deg")
    call("from-euler", folder / "door.csv", folder / "door.glb", *options)
    return call("to-euler", folder / "door.glb", "-", "--format", "json").product()


@needs_page
@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("-", "-"), "can't both be stdin"),
        (("-", "page.html"), "B is 'page.html' (expected a file to compare with)"),
        (("-", "-o", "page.png"), "no .html file"),
        (("-", "-o", "a.html", "--show", "bones,fire"), "'fire'"),
    ],
)
def test_wrong_usage(args: tuple[str, ...], words: str, call: Call) -> None:
    assert words in refusal(call("view", *args, stdin=built("arm")), 2)


@needs_page
def test_a_clip_or_node_that_is_not_there(call: Call) -> None:
    assert "nothing" in refusal(call("view", "-o", "-", "--clip", "nothing", stdin=built("arm")), 5)
    assert "nobody" in refusal(call("view", "-o", "-", "--node", "nobody", stdin=built("arm")), 5)


@needs_page
def test_faults_name_their_file(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    good, bad = fixture("arm"), tmp_path / "bad.gltf"
    bad.write_bytes(fixtures.BROKEN["times_negative"].data)
    page = tmp_path / "page.html"
    for files in ((bad,), (good, bad), (bad, good)):
        run = call("view", *files, "-o", page)
        assert run.code == 3
        assert [line.partition(": bad.gltf: ")[0] for line in run.err.splitlines()] == [
            *["note: without errors over time"] * (len(files) - 1),
            "gltf-anim",
        ]
    assert ": arm.glb: no clip matches" in refusal(call("view", good, "-o", page, "--clip", "nothing"), 5)
    assert not page.exists()


def test_without_its_script_the_command_that_builds_it_is_named(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resources, "SCRIPT", "bundle/absent.js")
    run = call("view", "-o", "-", stdin=built("arm"))
    assert run.code == 4
    assert resources.BUILD_COMMAND in run.err


def test_one_answer_on_the_loopback_and_no_second() -> None:
    got: list[object] = []

    def visit(address: str) -> bool:
        def fetch() -> None:
            for url in (address.rpartition("/")[0] + "/favicon.ico", address):
                try:
                    with urllib.request.urlopen(url, timeout=10) as answer:
                        got.append(answer.read())
                except urllib.error.HTTPError as error:
                    got.append(error.code)

        threading.Thread(target=fetch).start()
        assert address.startswith("http://127.0.0.1:")
        return True

    assert browser.show_once(b"<p>page", open_url=visit)
    for thread in threading.enumerate():
        if thread is not threading.current_thread():
            thread.join(10)
    assert got == [404, b"<p>page"]


def test_a_command_that_ends_with_the_browser() -> None:
    """The page is answered while the command that opens it still runs."""

    def visit(address: str) -> bool:
        with urllib.request.urlopen(address, timeout=10) as answer:
            return bool(answer.read())

    assert browser.show_once(b"<p>page", open_url=visit)


def test_without_a_browser_it_ends() -> None:
    assert not browser.show_once(b"", open_url=lambda _: False)
    assert not browser.show_once(b"", open_url=lambda _: True, wait=0.05)


@needs_page
def test_a_bake_beside_its_source(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    cache = tmp_path / "wave.npz"
    call("bake", fixture("biped"), cache, "--clip", "wave", "--fps", "8")
    call("diff", fixture("biped"), cache, "--clip", "wave", "--html", tmp_path / "d.html").product()
    said = facts((tmp_path / "d.html").read_bytes())
    assert said["view"]["clip"] == "wave"
    assert list(said["partners"].values()) == [0]
    assert said["meshes"][1] is None
    (curve,) = said["errors"].values()
    report = json.loads(call("diff", fixture("biped"), cache, "--clip", "wave", "--format", "json").product())
    assert curve["max"] == report["max_error_m"] == pytest.approx(max(curve["errors"]), rel=1e-6)
    assert said["view"]["t"] == report["clips"][0]["time_s"]


@needs_page
def test_the_page_of_a_bake_shows_what_is_in_it_and_warns_of_the_rest(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    _write_with_statue(Path("a.glb"))
    options = ("--clip", "wave", "--fps", "4", "--html", "b.html")
    warning = "skipped 3818 vertices of unskinned meshes (include with --rigid)"
    assert warning in call("bake", "a.glb", "a.npz", *options).err
    call("view", "a.glb", "a.npz", "--clip", "wave", "-o", "v.html").product()
    for name, place in (("b.html", 1), ("v.html", 0)):
        said = facts(Path(name).read_bytes())
        assert said["hidden"] == [[STATUE], []]
        panel = said["panels"][place]
        assert panel["about"] == f"Only the meshes in a.npz are shown: {warning}"
        statue, clips = panel["rows"]
        assert (statue["cells"], statue["link"]["node"]) == (["statue", "3818 vertices"], STATUE)
        assert clips["cells"] == ["2 other clips"]


@pytest.mark.slow
@needs_page
def test_the_page_of_a_bake_in_other_orders_and_of_other_meshes(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    _write_with_statue(Path("a.glb"))
    options = ("--clip", "wave", "--fps", "4", "--html", "b.html")
    call("bake", "a.glb", "a.npz", *options)
    call("view", "a.npz", "a.glb", "-o", "w.html").product()
    assert facts(Path("w.html").read_bytes())["hidden"] == [[], [STATUE]]
    call("bake", "a.glb", "a.npz", *options, "--rigid")
    assert "hidden" not in facts(Path("b.html").read_bytes())
    call("bake", "a.glb", "part.glb", *options, "--mesh", "body*")
    assert facts(Path("b.html").read_bytes())["hidden"] == [[STATUE], []]


def test_skinned_meshes_that_a_page_of_a_bake_leaves_out_are_counted_too() -> None:
    words = only_baked_words(scene(opened_fixture("biped")).instances, "part.npz")
    assert words == "Only the meshes in part.npz are shown: skipped 3818 vertices of other meshes"


STATUE = 22  # index of a node


def _write_with_statue(path: Path) -> None:
    """The biped, and its mesh once more without a skin."""
    json = opened_fixture("biped").json
    assert len(json["nodes"]) == STATUE
    nodes = [*json["nodes"], {"name": "statue", "mesh": 0, "translation": [1, 0, 0]}]
    scenes = [{**each, "nodes": [*each["nodes"], STATUE]} for each in json["scenes"]]
    path.write_bytes(glb_of(replace(opened_fixture("biped"), json={**json, "nodes": nodes, "scenes": scenes})))


@needs_page
def test_bakes_and_conversions_write_the_page_of_diff(
    fixture: Fixture, call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "out").mkdir()
    monkeypatch.chdir(tmp_path)
    run = call("bake", fixture("biped"), "out/w.glb", "--clip", "wave", "--fps", "8", "--html", "b.html")
    assert "b.html  " in run.err
    said = facts((tmp_path / "b.html").read_bytes())
    assert [each["name"] for each in said["files"]] == ["biped.glb", "w.glb"]
    assert said["meshes"][0]
    assert [each["title"] for each in said["panels"]] == ["Largest errors", "Not in the bake"]
    assert [each["cells"] for each in said["panels"][1]["rows"]] == [["2 other clips"]]
    assert "c.html  " in call("convert-cache", "out/w.glb", "out/w.npz", "--html", "c.html").err
    said = facts((tmp_path / "c.html").read_bytes())
    assert [each["name"] for each in said["files"]] == ["w.glb", "w.npz"]
    assert said["view"]["show"] == ["heat"]
