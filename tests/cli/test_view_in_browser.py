"""Pages in Chromium: no console message, no request, every key, the scrubber, a phone; and the errors of `diff`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.browser import CHROMIUM, OTHER_ENGINES, EngineError, missing, needs_browser, visit
from tests.cli.conftest import Call, Find, Fixture
from tests.cli.running import built
from tests.cli.test_table import renamed
from tests.cli.test_view import MARKUP

ASSETS = (
    *(
        "AnimationPointer/24_animation_pointer.gltf",
        "BitmojiRun.glb",
        "BoxAnimated.gltf",
        "BusterDrone/busterDrone.gltf",
    ),
    *("CesiumMan-gltf/CesiumMan.gltf", "CesiumMan.glb", "CubicMorph/01_cs_morph.gltf", "CubicRotate/01_cs_rotate.gltf"),
    *("Fox.glb", "InterpolationTest.gltf", "Knight.glb", "MorphStressTest.glb", "RiggedSimple.gltf", "Robot.glb"),
    *("SimpleMorph.gltf", "SimpleSkin.gltf", "bvh/cmu_01_01.bvh", "bvh/example.bvh", "bvh/freebvh.bvh"),
)
COMPARED = ("Fox.glb", "CesiumMan.glb", "Robot.glb", "MorphStressTest.glb", "BitmojiRun.glb", "Knight.glb")
RELATIVE_TOLERANCE = 1e-3  # between the page, in float32, and `diff`


@pytest.mark.slow
@needs_browser
def test_every_key_of_two_files_and_names_with_markup(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    one, small = tmp_path / "a.glb", tmp_path / "b.glb"
    one.write_bytes(renamed(built("biped"), [MARKUP, "wave"]))
    call("optimize", one, small, "--max-error", "3%", "--effort", "fast")
    call("view", one, small, "-o", tmp_path / "ab.html", "--title", MARKUP).product()
    call("bake", one, tmp_path / "wave.npz", "--clip", "wave", "--fps", "6").product()
    call("view", tmp_path / "wave.npz", "-o", tmp_path / "cache.html", "--show", "bones").product()
    found, cached = visit([tmp_path / "ab.html", tmp_path / "cache.html"])
    assert not [*found.words, *cached.words]
    assert not [*found.faults, *cached.faults]
    assert found.worst


@pytest.mark.slow
@needs_browser
def test_every_asset(asset: Find, call: Call, tmp_path: Path) -> None:
    pages = []
    for name in ASSETS:
        pages.append(tmp_path / f"{Path(name).name}.html")
        call("view", asset(name), "-o", pages[-1]).product()
    found = visit(pages)
    assert len(found) == len(ASSETS)
    assert not {each.name: each.words for each in found if each.words}
    assert not {each.name: each.faults for each in found if each.faults}


@pytest.mark.slow
@needs_browser
@pytest.mark.parametrize("name", COMPARED)
def test_the_largest_error_is_that_of_diff(name: str, asset: Find, call: Call, tmp_path: Path) -> None:
    _check_largest_error(asset(name), CHROMIUM, call, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("engine", OTHER_ENGINES)
def test_another_engine(engine: str, asset: Find, call: Call, tmp_path: Path) -> None:
    """Every key, no request, and the error of `diff`; in Firefox no console message either."""
    if reason := missing(engine):
        pytest.skip(reason)
    try:
        _check_largest_error(asset("Fox.glb"), engine, call, tmp_path)
    except EngineError as error:
        pytest.skip(str(error))


def _check_largest_error(path: Path, engine: str, call: Call, folder: Path) -> None:
    small, page = folder / "small.glb", folder / f"{path.stem}-compared.html"
    call("optimize", path, small, "--max-error", "1%", "--effort", "fast")
    call("view", path, small, "-o", page).product()
    report = json.loads(call("diff", path, small, "--shell", "0", "--format", "json").product())
    (found,) = visit([page], engine)
    assert not found.words
    assert not found.faults
    worst = max(each["error"] for each in found.worst)
    assert worst == pytest.approx(report["max_error_m"], rel=RELATIVE_TOLERANCE)
    bound = max(each["certified_error_m"] for each in report["clips"])
    assert worst <= bound + 1e-6 * report["diagonal_m"]


@pytest.mark.slow
@needs_browser
def test_heat_of_a_bake(asset: Find, call: Call, tmp_path: Path) -> None:
    """A bake is paired with its source vertex by vertex, also as one mesh of a source with several."""
    pages, reports = [], []
    for name in ("b.npz", "b.glb"):
        pages.append(tmp_path / f"{name}.html")
        options = ("--clip", "Robot_Wave", "--fps", "6", "--html", pages[-1])
        assert f"{name}.html  " in call("bake", asset("Robot.glb"), tmp_path / name, *options).err
        args = ("diff", asset("Robot.glb"), tmp_path / name, "--clip", "Robot_Wave", "--format", "json")
        reports.append(json.loads(call(*args).product()))
    for found, report in zip(visit(pages), reports, strict=True):
        assert not found.words
        assert not found.faults
        worst = max(each["error"] for each in found.worst)
        assert worst == pytest.approx(report["max_error_m"], abs=1e-4 * report["diagonal_m"])
