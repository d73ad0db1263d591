"""`inspect` and `loop` say the same about a clip's seam."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

import fixtures
from anim.gltf.document import Document
from tests.cli.conftest import Call, Fixture
from tests.cli.inspecting import only
from tests.files import REAL, glb_of, opened_fixture


def _same(call: Call, path: Path) -> None:
    found = call("loop", path, "--format", "json").json
    clips = only(call, path)["clips"]
    assert len(clips) == len(found["loops"])
    for each, judged in zip(clips, found["loops"], strict=True):
        assert each["seam_m"] == pytest.approx(judged["seam_m"], rel=1e-6)
        assert each["seam_speed_m_per_s"] == pytest.approx(judged["speed_seam_m_per_s"], rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("name", list(fixtures.FIXTURES))
def test_fixtures(name: str, call: Call, fixture: Fixture) -> None:
    _same(call, fixture(name))


@pytest.mark.slow
@pytest.mark.parametrize("name", REAL)
def test_real_files(name: str, call: Call, asset: Callable[[str], Path]) -> None:
    _same(call, asset(name))


def test_where_there_is_no_skin_it_says_so(call: Call, fixture: Fixture) -> None:
    path = fixture("arm")
    assert {clip["seam_measured_on"] for clip in only(call, path)["clips"]} == {"skin"}
    assert "loop gap (nodes)" not in call("inspect", path).text
    bare = _without_meshes(opened_fixture("arm"))
    assert {clip["seam_measured_on"] for clip in only(call, bare)["clips"]} == {"nodes"}
    assert "loop gap (nodes)" in call("inspect", "-", stdin=bare).text


def _without_meshes(document: Document) -> bytes:
    content = {key: value for key, value in document.json.items() if key not in ("meshes", "skins")}
    nodes = content["nodes"]
    content["nodes"] = [{k: v for k, v in node.items() if k not in ("mesh", "skin")} for node in nodes]
    return glb_of(replace(document, json=content))
