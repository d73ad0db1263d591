"""Points of many meshes at once are those that usd-core has for each of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from anim.arrays import Floats
from anim.caches.storage import Memory
from anim.exchange.usd_skel.stage_points import StagePoints
from anim.exchange.usd_skel.write import write
from anim.gltf.document import Document
from anim.gltf.reading import reader
from tests import many
from tests.calls import count_calls
from tests.files import opened, opened_fixture
from tests.usd import opened_stage, skinned_stage, world_points

pytest.importorskip("pxr", reason="usd-core is not installed")

CODES = (0.0, 1.0, 7.0, 12.0)  # of samples: between those UsdSkel.BakeSkinning interpolates points


def stage_of(document: Document, folder: Path) -> Path:
    outputs = Memory("out.usdc")
    write(document, reader.scene(document, normals=True), reader.clips(document)[0], outputs, ending=".usdc")
    for name, data in outputs.files.items():
        (folder / name).write_bytes(data)
    return folder / "out.usdc"


def meshes_of(stage: Any) -> list[Any]:
    from pxr import UsdGeom

    return [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]


def points_at(path: Path, code: float) -> Floats:
    """The points of all meshes, skinned by UsdSkel.BakeSkinning."""
    found = world_points(skinned_stage(path), code)
    return np.concatenate([found[str(mesh.GetPath())] for mesh in meshes_of(opened_stage(path))])


@pytest.mark.parametrize("name", ["biped", "arm", "flag", "morph_cube", "interpolations", "ponytail"])
def test_fixtures(name: str, tmp_path: Path) -> None:
    compare(opened_fixture(name), tmp_path)


@pytest.mark.parametrize("make", [many.skins, many.skins_different, many.side_meshes, many.chain_mesh])
def test_files_of_many(make: many.Make, tmp_path: Path) -> None:
    compare(opened(make(20)), tmp_path)


def compare(document: Document, folder: Path) -> None:
    path = stage_of(document, folder)
    stage = opened_stage(path)
    points = StagePoints(stage, meshes_of(stage))
    for code in CODES:
        np.testing.assert_allclose(points.at(code), points_at(path, code), rtol=0, atol=1e-6)


def test_meshes_of_all_skeletons_are_skinned_in_one_call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from pxr import UsdSkel

    stage = opened_stage(stage_of(opened(many.skins_different(30)), tmp_path))
    points = StagePoints(stage, meshes_of(stage))
    counted = count_calls(monkeypatch, UsdSkel, "SkinPointsLBS")
    points.at(3.0)
    assert len(counted) == 1


def test_what_does_not_move_is_placed_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from pxr import UsdGeom

    stage = opened_stage(stage_of(opened(many.side_meshes(30)), tmp_path))
    points = StagePoints(stage, meshes_of(stage))
    counted = count_calls(monkeypatch, UsdGeom.XformCache, "GetLocalToWorldTransform")
    points.at(3.0)
    assert len(counted) == 1  # of the only animated node
