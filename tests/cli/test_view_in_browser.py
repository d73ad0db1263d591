"""Pages in Chromium: no console message, no request, every key, the scrubber, a phone; and the errors of `diff`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.browser import needs_browser, visit
from tests.cli.conftest import Call, Find, Fixture
from tests.cli.running import built
from tests.cli.test_table import renamed
from tests.cli.test_view import MARKUP

pytestmark = needs_browser

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
COMPARED = ("Fox.glb", "CesiumMan.glb", "Robot.glb", "MorphStressTest.glb", "BitmojiRun.glb")
RELATIVE_TOLERANCE = 1e-3  # between the page, in float32, and `diff`


def test_every_key_of_two_files_and_names_with_markup(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    one, small = tmp_path / "a.glb", tmp_path / "b.glb"
    one.write_bytes(renamed(built("biped"), [MARKUP, "wave"]))
    call("optimize", one, small, "--max-error", "3%", "--effort", "fast")
    call("view", one, small, "-o", tmp_path / "ab.html", "--title", MARKUP).product()
    (found,) = visit([tmp_path / "ab.html"])
    assert not found.words
    assert not found.faults
    assert found.worst


@pytest.mark.slow
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
@pytest.mark.parametrize("name", COMPARED)
def test_the_largest_error_is_that_of_diff(name: str, asset: Find, call: Call, tmp_path: Path) -> None:
    small, page = tmp_path / "small.glb", tmp_path / "ab.html"
    call("optimize", asset(name), small, "--max-error", "1%", "--effort", "fast")
    call("view", asset(name), small, "-o", page).product()
    report = json.loads(call("diff", asset(name), small, "--shell", "0", "--format", "json").product())
    (found,) = visit([page])
    assert not found.faults
    worst = max(each["error"] for each in found.worst)
    assert worst == pytest.approx(report["max_error_m"], rel=RELATIVE_TOLERANCE)
    bound = max(each["certified_error_m"] for each in report["clips"])
    assert worst <= bound + 1e-6 * report["diagonal_m"]
