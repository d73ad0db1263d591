"""`diff` of a bake with its source, and of caches, by vertex."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Call, Find, Fixture
from tests.cli.running import help_line, refusal
from tests.files import glb_of, opened_fixture
from tests.textured import textured

FORMATS = ["npz", "pc2", "mdd", "usdc", "usdz", "glb"]


@pytest.fixture
def source(tmp_path: Path) -> Path:
    pytest.importorskip("pxr", reason="usd-core is not installed")
    path = tmp_path / "textured.glb"
    path.write_bytes(textured())
    return path


@pytest.mark.slow
@pytest.mark.parametrize("ending", FORMATS)
def test_every_format_is_within_its_error(call: Call, source: Path, ending: str) -> None:
    """At 64 frames per second linear interpolation misses the arc by less than a millimetre."""
    out = source.with_name(f"out.{ending}")
    more = ("--max-error", "0.01mm") if ending == "glb" else ()
    assert call("bake", source, out, "--clip", "bend", "--fps", 64, *more).code == 0
    if ending == "pc2":  # which has no rate
        return
    for files in ((source, out), (out, source)):
        found = call("diff", *files, "--clip", "bend", "--format", "json").json
        assert found["measured_at"] == "vertices"
        assert 0 < found["max_error_m"] < 1e-3
        assert found["clips"][0]["clip"] == "bend"


@pytest.mark.parametrize("more", [(), ("--quantize",), ("--layout", "flip-scale")])
def test_a_bake_of_morph_targets(call: Call, fixture: Fixture, tmp_path: Path, more: tuple[str, ...]) -> None:
    """The weights of the bake's own targets mean nothing to the source: only vertices can be compared."""
    source, out = fixture("morph_cube"), tmp_path / "out.glb"
    bound = () if "--layout" in more else ("--max-error", "0.1mm")
    assert call("bake", source, out, "--clip", "cubic", "--fps", 240, *bound, *more).code == 0
    for files in ((source, out), (out, source)):
        found = call("diff", *files, "--clip", "cubic", "--format", "json").json
        assert found["measured_at"] == "vertices"
        assert 0 < found["max_error_m"] < (0.05 if "--layout" in more else 1e-3)


def test_versions_of_morphed_files_are_compared_by_joints(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    source, out = fixture("morph_cube"), tmp_path / "out.glb"
    assert call("optimize", source, out, "--max-error", "1mm").code == 0
    assert call("diff", source, out, "--format", "json").json["measured_at"] != "vertices"


def test_a_changed_vertex_is_named(call: Call, source: Path) -> None:
    out = source.with_name("out.npz")
    assert call("bake", source, out, "--clip", "bend", "--fps", 64).code == 0
    with np.load(out) as file:
        arrays = dict(file)
    arrays["positions"][32, 20] += (0, 0, 0.25)
    np.savez(out, **arrays)
    (clip,) = call("diff", source, out, "--clip", "bend", "--format", "json").json["clips"]
    assert (clip["mesh"], clip["vertex"]) == ("body", 20)
    assert clip["time_s"] == pytest.approx(0.5)
    assert clip["max_error_m"] == pytest.approx(0.25, abs=1e-3)
    run = call("diff", source, out, "--clip", "bend", "--fail-above", "1cm")
    assert run.code == 6
    assert "max 25 cm" in run.text


@pytest.mark.parametrize("layout", ["morph", "flip-scale", "flip-visibility"])
@pytest.mark.parametrize("more", [(), ("--rigid",), ("--space", "mesh"), ("--quantize",)])
def test_a_bake_in_gltf(call: Call, source: Path, layout: str, more: tuple[str, ...]) -> None:
    if layout != "morph" and more[:1] in (("--quantize",), ("--space",)):
        return
    out = source.with_name("out.glb")
    limit = ("--max-error", "0.1mm") if layout == "morph" else ()
    if "--space" in more:  # skinned vertices are in the space of the scene
        more = ()
    assert call("bake", source, out, "--clip", "bend", "--fps", 64, "--layout", layout, *limit, *more).code == 0
    found = call("diff", source, out, "--clip", "bend", "--format", "json").json
    assert found["max_error_m"] < 1e-3
    piped = call("diff", "-", out, "--clip", "bend", "--format", "json", stdin=source.read_bytes()).json
    assert piped["max_error_m"] == found["max_error_m"]


def test_a_range_is_compared_where_both_are(call: Call, source: Path) -> None:
    out = source.with_name("out.npz")
    assert call("bake", source, out, "--clip", "bend", "--fps", 64, "--from", "0.25", "--to", "0.5").code == 0
    assert call("diff", source, out, "--clip", "bend", "--fail-above", "1mm").code == 0


def test_refusals(call: Call, source: Path, fixture: Find) -> None:
    out = source.with_name("out.npz")
    assert call("bake", source, out, "--clip", "bend").code == 0
    run = call("diff", source, out)
    assert "has 2 clips, a cache has one" in refusal(run, 2)
    assert help_line(run) == "choose one with --clip"
    assert "--player does not apply to caches" in refusal(call("diff", source, out, "--player", "three"), 2)
    assert "the meshes of the source have 530" in refusal(call("diff", fixture("arm"), out, "--clip", "bend"), 2)
    assert call("diff", out, out, "--fail-above", "0").code == 0


def test_a_clip_without_name_is_compared_with_its_bake(call: Call, tmp_path: Path) -> None:
    document = opened_fixture("arm")
    clips = [{key: value for key, value in document.json["animations"][0].items() if key != "name"}]
    source, out = tmp_path / "source.glb", tmp_path / "out.glb"
    source.write_bytes(glb_of(replace(document, json={**document.json, "animations": clips})))
    assert call("bake", source, out, "--fps", 64).code == 0
    for files in ((source, out), (out, source)):
        assert 0 < call("diff", *files, "--format", "json").json["max_error_m"] < 1e-2
