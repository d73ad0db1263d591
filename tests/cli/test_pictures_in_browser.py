"""Pictures by three.js in Chromium: baked GLB and skinned USDZ beside their source, texel for texel almost the same."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.arrays import Floats
from anim.gltf.reading import reader
from anim.skinning.bake import prepare_bake
from tests import judge
from tests.browser import ROOT, TIMEOUT_S, executable, missing_browser, package
from tests.cli.conftest import Call, Find
from tests.files import glb_of, opened, opened_path
from tests.judge import needs_judge
from tests.textured import textured, without_losses

pytestmark = [
    pytest.mark.slow,
    needs_judge,
    pytest.mark.skipif(bool(missing_browser()), reason=missing_browser() or "present"),
]

SCRIPT = ROOT / "tests" / "browser" / "picture.mjs"
MAX_DIFFERENCE = 0.006  # mean of all pixels and channels, 0 … 1: edges and shading of vertices
MIN_DIFFERENCE = 0.01  # between two poses
ASSETS = [
    ("Fox.glb", "Survey", 1.0),
    ("CesiumMan.glb", "#0", 1.0),
    ("Knight.glb", "Cheer", 0.5),
    ("BitmojiRun.glb", "lbr_run_normal_anm_default", 0.3),
]


def pictures(jobs: list[dict[str, Any]], folder: Path) -> list[Floats]:
    """Return the pictures (512, 512, 3), 0 … 1, of files at a time of a clip."""
    from PIL import Image

    told = [{**job, "file": str(job["file"]), "out": str(folder / f"{i}.png")} for i, job in enumerate(jobs)]
    command = ["node", str(SCRIPT), str(package()), str(executable()), str(judge.package()), json.dumps(told)]
    run = subprocess.run(command, capture_output=True, timeout=TIMEOUT_S, check=False)
    assert run.returncode == 0, run.stderr.decode(errors="replace")
    faults = [each for each in json.loads(run.stdout)["words"] if each.startswith("error") and "404" not in each]
    assert not faults
    return [np.array(Image.open(each["out"]).convert("RGB"), np.float64) / 255 for each in told]


def view(source: Path) -> dict[str, Any]:
    """The camera for a file at rest."""
    rest = prepare_bake(reader.scene(opened_path(source)), rigid=True).rest
    low, high = rest.min(axis=0), rest.max(axis=0)
    return {"center": ((low + high) / 2).tolist(), "size": float(np.linalg.norm(high - low))}


def difference(a: Floats, b: Floats) -> float:
    return float(np.abs(a - b).mean())


@pytest.mark.parametrize(("name", "clip", "time"), ASSETS)
def test_bakes_and_skinned_usd_look_as_their_source(
    call: Call, asset: Find, tmp_path: Path, name: str, clip: str, time: float
) -> None:
    """But for what three.js leaves out of USD: blend shapes, both sides of faces, and points that move.

    Blender shows all of it: tests/cli/test_in_blender.py.
    """
    source, names = tmp_path / "source.glb", reader.names(opened_path(asset(name)))
    source.write_bytes(glb_of(without_losses(opened_path(asset(name)))))
    number = names.index(clip) if clip in names else 0
    baked, skinned, points = tmp_path / "baked.glb", tmp_path / "skinned.usdz", tmp_path / "points.usdz"
    for command, out in (("bake", baked), ("convert", skinned), ("bake", points)):
        more = ("--rigid",) if command == "bake" else ()
        assert call(command, source, out, "--clip", clip, *more).code == 0
    seen = view(source)
    files = [(source, number), (source, None), (baked, 0), (skinned, 0), (points, None)]
    jobs = [{"file": file, "time": time, "clip": chosen, **seen} for file, chosen in files]
    posed, still, *others, cache = pictures(jobs, tmp_path)
    assert difference(posed, np.ones_like(posed)) > MIN_DIFFERENCE
    assert difference(posed, still) > MIN_DIFFERENCE
    for each in others:
        assert difference(each, posed) < MAX_DIFFERENCE
    assert difference(cache, still) < MAX_DIFFERENCE  # three.js does not play points of USD


def test_two_materials_and_a_texture_transform(call: Call, tmp_path: Path) -> None:
    """The transform is seen: the picture without it is another one.

    three.js moves no nodes of USD, hence no flag, and its UsdTransform2d rotates before it scales, the other way around
    than USD and Blender, hence no rotation; with one, tests/cli/test_in_blender.py compares.
    """
    document = without_losses(opened(textured()))
    for material in document.json["materials"]:  # metal is black without surroundings
        material["pbrMetallicRoughness"]["metallicFactor"] = 0
    del document.json["nodes"][5]["mesh"]
    color = document.json["materials"][1]["pbrMetallicRoughness"]["baseColorTexture"]
    del color["extensions"]["KHR_texture_transform"]["rotation"]
    source, plain, baked, skinned, points = (
        tmp_path / name for name in ("source.glb", "plain.glb", "baked.glb", "skinned.usdz", "points.usdz")
    )
    source.write_bytes(glb_of(document))
    for command, out in (("bake", baked), ("convert", skinned), ("bake", points)):
        assert call(command, source, out, "--clip", "bend").code == 0
    del color["extensions"]
    plain.write_bytes(glb_of(document))
    files = [(source, 0), (baked, 0), (skinned, 0), (source, None), (points, None), (plain, None)]
    jobs = [{"file": file, "time": 0.5, "clip": clip, **view(source)} for file, clip in files]
    posed, *others, still, cache, without = pictures(jobs, tmp_path)
    assert difference(posed, still) > MIN_DIFFERENCE
    assert difference(without, still) > MIN_DIFFERENCE
    for each in others:
        assert difference(each, posed) < MAX_DIFFERENCE
    assert difference(cache, still) < MAX_DIFFERENCE  # three.js does not play points of USD
