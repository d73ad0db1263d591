"""Draco files through the commands: bounds hold on the surface; without the package nobody promises one."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.measure.error.metric import ErrorMetric
from tests.cli.conftest import Call, Find
from tests.cli.running import help_line, refusal
from tests.draco import compressed
from tests.files import glb_of, opened_fixture, opened_path

BOUND = 1e-3  # m
INSTALL = "pip install 'gltf-anim[draco]'"


@pytest.fixture
def packed(tmp_path: Path) -> Path:
    path = tmp_path / "packed.glb"
    path.write_bytes(glb_of(compressed(opened_fixture("biped"))))
    return path


@pytest.fixture
def without_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "DracoPy", None)


def error_on(surface: Document, before: Document, after: Document) -> float:
    """The largest error, in m, of the vertices of a third file."""
    ruler = ErrorMetric(reader.scene(surface))
    pairs = zip(reader.clips(before), reader.clips(after), strict=True)
    return max(ruler.error(*each).max_error for each in pairs)


def test_the_bound_of_optimize_holds_on_the_surface(packed: Path, call: Call, tmp_path: Path) -> None:
    out, report = tmp_path / "out.glb", tmp_path / "report.json"
    run = call("optimize", packed, out, "--max-error", "1mm", "--effort", "fast", "--report", "-")
    assert run.code == 0, run.err
    del report
    assert run.json["measured_at"] == "surface"
    plain = opened_fixture("biped")  # whose vertices are known without Draco
    assert 0 < error_on(plain, opened_path(packed), opened_path(out)) <= BOUND * 1.01


@pytest.mark.slow
def test_the_bound_holds_on_a_real_file(call: Call, asset: Find, tmp_path: Path) -> None:
    source, out = tmp_path / "man.glb", tmp_path / "out.glb"
    source.write_bytes(glb_of(compressed(opened_path(asset("CesiumMan.glb")))))
    call("optimize", source, out, "--max-error", "1mm").product()
    assert 0 < error_on(opened_path(asset("CesiumMan.glb")), opened_path(source), opened_path(out)) <= BOUND * 1.01


@pytest.mark.usefixtures("without_package")
@pytest.mark.parametrize(
    "line",
    [
        ("optimize", "{}", "out.glb"),
        ("diff", "{}", "{}"),
        ("bake", "{}", "out.npz", "--clip", "walk"),
        ("collapse", "{}"),
        ("render", "{}", "out.png", "--clip", "walk"),
    ],
)
def test_what_needs_the_surface_is_exit_4_without_the_package(
    line: tuple[str, ...], packed: Path, call: Call, tmp_path: Path
) -> None:
    args = [str(tmp_path / word) if word.startswith("out.") else word.format(packed) for word in line]
    run = call(*args)
    assert "KHR_draco_mesh_compression, which needs the package DracoPy" in refusal(run, 4)
    assert help_line(run) == INSTALL
    assert list(tmp_path.iterdir()) == [packed]


@pytest.mark.usefixtures("without_package")
@pytest.mark.parametrize("quiet", [(), ("-q",)])
def test_resample_measures_at_nodes_and_says_so_even_when_quiet(
    quiet: tuple[str, ...], packed: Path, call: Call, tmp_path: Path
) -> None:
    run = call("resample", packed, tmp_path / "out.glb", "--fps", "5", *quiet)
    run.product()
    first, *others = run.err.splitlines()
    assert first.startswith("warning: measured at nodes, not on the surface: mesh 0")
    assert INSTALL in first
    assert bool(others) != bool(quiet)
    assert all("(nodes only)" in line for line in others)


def test_inspect_reads_the_skin(packed: Path, call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    (skin,) = call("inspect", packed, "--format", "json").json["files"][0]["skins"]
    assert skin["vertices"] == len(reader.scene(opened_fixture("biped")).instances[0].mesh.positions)
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    (file,) = call("inspect", packed, "--format", "json").json["files"]
    assert "vertices-unread" in [each["name"] for each in file["findings"]]


def test_reports_say_what_errors_are_measured_on(packed: Path, call: Call, fixture: Find, tmp_path: Path) -> None:
    assert call("diff", packed, packed, "--format", "json").json["measured_at"] == "surface"
    bare = fixture("interpolations")
    found = call("diff", bare, bare, "--format", "json").json["measured_at"]
    assert found == ("surface" if reader.scene(opened_path(bare)).vertex_count else "nodes")
