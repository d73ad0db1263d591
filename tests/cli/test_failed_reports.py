"""A report that can't be made leaves the other files of its command as they were."""

from __future__ import annotations

from pathlib import Path

import pytest

from anim.errors import FormatError
from anim.show.page.page import PageContent, PageFile
from tests.cli.conftest import Call, Fixture
from tests.cli.running import refusal

KINDS = [
    ("particles", "biped", ("--node", "head", "--duration", "0.1")),
    ("springs", "springs", ()),
    ("cloth", "flag", ("--mesh", "flag", "--pin", "x-min", "--duration", "0.1")),
    ("rigid", "wall", ("--body", "*", "--duration", "0.1")),
]
BVH = (
    "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n"
    "End Site\n{\nOFFSET 0 1 0\n}\n}\nMOTION\nFrames: 2\nFrame Time: 0.1\n0 0 0\n9 0 0\n"
)


@pytest.fixture(params=["infinity", "disk"])
def no_report(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every JSON report holds infinity, or no text can be stored."""

    def fail(*_args: object, **_options: object) -> str:
        raise FormatError("energy_j.start is inf: no report of it is possible")

    name = "cli.reports.json_report.dump" if request.param == "infinity" else "cli.io.documents.commit_text_after"
    monkeypatch.setattr(name, fail)


@pytest.mark.parametrize(("kind", "name", "options"), KINDS, ids=[kind for kind, _, _ in KINDS])
def test_a_dry_run_makes_the_report_of_a_simulation_and_writes_none(
    kind: str,
    name: str,
    options: tuple[str, ...],
    fixture: Fixture,
    call: Call,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if kind == "rigid":
        pytest.importorskip("rapier3d")
    report = tmp_path / "report.json"
    args = (kind, fixture(name), tmp_path / "out.glb", *options, "--dry-run", "--report")
    call("simulate", *args, report).product()
    assert "expected .json" in refusal(call("simulate", *args, tmp_path / "report.txt"), 2)
    monkeypatch.setattr("cli.reports.json_report.dump", _fail)
    run = call("simulate", *args, report)
    assert (run.code, run.err.count("no report of it is possible")) == (3, 1), run.err
    assert [path.name for path in tmp_path.iterdir()] == [f"{name}.glb"]


@pytest.mark.usefixtures("no_report")
@pytest.mark.parametrize(("kind", "name", "options"), KINDS, ids=[kind for kind, _, _ in KINDS])
def test_a_simulation_without_its_report_writes_nothing(
    kind: str, name: str, options: tuple[str, ...], fixture: Fixture, call: Call, tmp_path: Path
) -> None:
    if kind == "rigid":
        pytest.importorskip("rapier3d")
    out, report = tmp_path / "keep.glb", tmp_path / "report.json"
    out.write_bytes(b"precious")
    report.write_bytes(b"old")
    run = call("simulate", kind, fixture(name), out, *options, "--report", report)
    assert (run.code, run.err.count("no report of it is possible")) == (3, 1), run.err
    assert (out.read_bytes(), report.read_bytes()) == (b"precious", b"old")
    assert not list(tmp_path.glob(".*"))


def test_a_simulation_that_cannot_be_written_leaves_its_report(
    fixture: Fixture, call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_args: object, **_options: object) -> int:
        raise FormatError("no")

    monkeypatch.setattr("cli.io.documents.write", fail)
    report = tmp_path / "report.json"
    report.write_bytes(b"old")
    args = (fixture("biped"), tmp_path / "out.glb", "--node", "head", "--duration", "0.1", "--report", report)
    assert call("simulate", "particles", *args).code == 3
    assert report.read_bytes() == b"old"


def test_masses_whose_energies_overflow_are_refused(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    out = tmp_path / "keep.glb"
    out.write_bytes(b"precious")
    args = (fixture("biped"), out, "--node", "head", "--mass", "1e308", "--duration", "0.1")
    run = call("simulate", "particles", *args, "--report", tmp_path / "q.json")
    assert (run.code, out.read_bytes()) == (2, b"precious")
    assert run.err == "gltf-anim: --mass is 1e+308 kg (expected above 0, at most 1e+12)\n"


def _fail(*_args: object, **_options: object) -> str:
    raise FormatError("no report of it is possible")


def test_motion_without_its_json_report_replaces_nothing(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.bvh").write_text(BVH)
    out = tmp_path / "keep.glb"
    out.write_bytes(b"precious")
    monkeypatch.setattr("cli.reports.from_euler_report.as_json", _fail)
    run = call("from-euler", tmp_path / "a.bvh", out, "--format", "json")
    assert (run.code, run.out, out.read_bytes()) == (3, b"", b"precious"), run.err


@pytest.mark.parametrize("command", ["collapse", "diff"])
def test_a_plot_without_its_json_report_replaces_nothing(
    command: str, fixture: Fixture, call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib")
    plot = tmp_path / "keep.svg"
    plot.write_bytes(b"precious")
    monkeypatch.setattr(f"cli.reports.{command}_report.as_json", _fail)
    path = fixture("arm")
    inputs = (path,) if command == "collapse" else (path, path)
    run = call(command, *inputs, "--plot", plot, "--format", "json")
    assert (run.code, run.out, plot.read_bytes()) == (3, b"", b"precious"), run.err


def test_a_model_without_its_page_is_not_replaced(
    fixture: Fixture, call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cli.io.page_output.check_page", lambda *_args: None)  # also without the page's script
    monkeypatch.setattr("anim.show.page.page.page", _fail)
    out, html = tmp_path / "keep.glb", tmp_path / "keep.html"
    for path in (out, html):
        path.write_bytes(b"precious")
    for dry_run in ((), ("--dry-run",)):
        run = call("optimize", fixture("noop"), out, "--html", html, *dry_run)
        assert (run.code, out.read_bytes(), html.read_bytes()) == (3, b"precious", b"precious"), run.err


@pytest.mark.parametrize(
    ("option", "maker"),
    [
        (("--report", "a.json"), "cli.reports.optimize_json.as_json"),
        (("--html", "a.html"), "anim.show.page.page.page"),
        (("--curve", "a.csv"), "cli.workflows.rate_curve._csv"),
    ],
)
def test_a_dry_run_of_optimize_makes_its_other_outputs_and_writes_none(
    option: tuple[str, str],
    maker: str,
    fixture: Fixture,
    call: Call,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("cli.io.page_output.check_page", lambda *_args: None)
    monkeypatch.setattr("anim.show.page.page.page", lambda *_args, **_options: b"page")
    args = ("optimize", fixture("arm"), tmp_path / "o.glb", "-n", "--effort", "fast", option[0], tmp_path / option[1])
    assert call(*args).product() == b""
    monkeypatch.setattr(maker, _fail)
    run = call(*args)
    assert (run.code, run.err.count("no report of it is possible")) == (3, 1), run.err
    assert [path.name for path in tmp_path.iterdir()] == ["arm.glb"]


CACHES = [
    ("bake", "arm.glb", "keep.npz", ("--clip", "bend")),
    ("bake", "arm.glb", "keep.gltf", ("--clip", "bend")),
    ("convert-cache", "arm.npz", "keep.pc2", ()),
    ("convert-cache", "arm.npz", "keep.npz", ("--fps", "6")),
    ("convert-cache", "arm.npz", "keep.ply", ()),
]
CACHE_IDS = [f"{command} {out}" for command, _, out, _ in CACHES]


@pytest.fixture
def arm(fixture: Fixture, call: Call, tmp_path: Path) -> Path:
    """The folder of an arm and its bake."""
    call("bake", fixture("arm"), tmp_path / "arm.npz", "--clip", "bend", "--fps", "12").product()
    return tmp_path


@pytest.mark.parametrize("cause", ["page", "disk"])
@pytest.mark.parametrize(("command", "path", "out", "options"), CACHES, ids=CACHE_IDS)
def test_a_cache_without_its_page_is_not_replaced(
    command: str,
    path: str,
    out: str,
    options: tuple[str, ...],
    cause: str,
    arm: Path,
    call: Call,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("cli.workflows.cache_page.check_page", lambda *_args: None)  # also without the page's script
    monkeypatch.setattr("cli.workflows.cache_page.page", _fail if cause == "page" else lambda *_args, **_options: b"")
    if cause == "disk":
        monkeypatch.setattr("cli.io.documents.commit_text_after", _fail)
    for name in (out, "keep.html", "keep_00001.ply"):
        (arm / name).write_bytes(b"precious")
    before = {each.name: each.read_bytes() for each in arm.iterdir()}
    run = call(command, arm / path, arm / out, *options, "--html", arm / "keep.html")
    assert (run.code, run.err.count("no report of it is possible")) == (3, 1), run.err
    assert {each.name: each.read_bytes() for each in arm.iterdir()} == before


@pytest.mark.parametrize(("command", "path", "out", "options"), CACHES, ids=CACHE_IDS)
def test_a_cache_that_cannot_be_written_leaves_its_page(
    command: str,
    path: str,
    out: str,
    options: tuple[str, ...],
    arm: Path,
    call: Call,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("cli.workflows.cache_page.check_page", lambda *_args: None)
    monkeypatch.setattr("cli.workflows.cache_page.page", lambda *_args, **_options: b"new")
    monkeypatch.setattr("anim.files.atomic.AtomicOutputs.commit", _fail)
    (arm / "keep.html").write_bytes(b"old")
    assert call(command, arm / path, arm / out, *options, "--html", arm / "keep.html").code == 3
    assert (arm / "keep.html").read_bytes() == b"old"


@pytest.mark.parametrize("dry", [True, False])
@pytest.mark.parametrize(("command", "path", "out", "options"), CACHES, ids=CACHE_IDS)
def test_the_page_of_a_cache_shows_both_files_also_if_one_replaces_the_other(
    command: str,
    path: str,
    out: str,
    options: tuple[str, ...],
    dry: bool,
    arm: Path,
    call: Call,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made: list[tuple[str, str, int, float]] = []

    def keep(one: PageFile, other: PageFile, *, content: PageContent, **_options: object) -> bytes:
        (error,) = content.errors.values()
        made.append((one.name, other.name, other.size, error.max))
        return b"page"

    monkeypatch.setattr("cli.workflows.cache_page.check_page", lambda *_args: None)
    monkeypatch.setattr("cli.workflows.cache_page.page", keep)
    target = path if out.endswith(path[-4:]) else out  # in place where the format is the same
    before = {each.name: each.read_bytes() for each in arm.iterdir()}
    dry_run = ("--dry-run",) if dry else ()
    call(command, arm / path, arm / target, *options, "--html", arm / "a.html", *dry_run).product()
    after = {each.name: each.read_bytes() for each in arm.iterdir()}
    written = {name: data for name, data in after.items() if before.get(name) != data}
    ((one, other, size, error),) = made
    assert (one, other) == (path, target)
    assert (error > 1e-3) is bool(options), error  # between frames, or 0
    assert ("a.html" in written) is not dry
    assert dry or size == sum(len(data) for name, data in written.items() if name != "a.html")
