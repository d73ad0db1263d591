"""Tangents in every format that has a place for them, read by numpy, usd-core and pygltflib."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pygltflib import GLTF2

from anim.arrays import AnyArray
from anim.caches.options import WriteOptions
from anim.caches.registry import CACHE_FORMATS
from anim.caches.transforms.resample import at_time
from anim.caches.transforms.up_axis import to_up_axis
from anim.caches.transforms.vertex_order import reorder
from anim.errors import FormatError
from anim.model import VertexCache
from tests.anim.caches.making import cache, opened, written
from tests.khronos import errors, needs_validator, validate_many

SOURCE = cache(tangents=True)


def tangents_of(of: VertexCache) -> AnyArray:
    found = of.load_all().tangents
    assert found is not None
    return found


def test_the_table_says_who_holds_them() -> None:
    assert {name for name, each in CACHE_FORMATS.items() if "tangents" in each.holds} == {
        ".gltf",
        ".npz",
        ".usdc",
        ".usda",
        ".usdz",
        ".glb",
    }


def test_numpy_reads_them() -> None:
    files, _ = written(SOURCE, "a.npz")
    with np.load(io.BytesIO(files.files["a.npz"])) as arrays:
        assert (arrays["tangents"] == tangents_of(SOURCE)).all()
        assert arrays["handedness"].tolist() == [-1, 1, 1] * 3
    back = opened(files)
    assert (tangents_of(back) == tangents_of(SOURCE)).all()
    assert np.array_equal(back.handedness, SOURCE.handedness)  # type: ignore[arg-type]


def test_one_without_the_other_is_refused() -> None:
    files, _ = written(SOURCE, "a.npz")
    with np.load(io.BytesIO(files.files["a.npz"])) as arrays:
        kept = {name: arrays[name] for name in arrays if name != "handedness"}
    bare = io.BytesIO()
    np.savez(bare, **kept)
    files.files["a.npz"] = bare.getvalue()
    with pytest.raises(FormatError, match="don't go together"):
        opened(files)


@pytest.mark.parametrize("ending", [".usdc", ".usda"])
def test_usd_core_reads_them(ending: str, tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom

    files, _ = written(SOURCE, f"a{ending}")
    path = tmp_path / f"a{ending}"
    path.write_bytes(files.files[f"a{ending}"])
    stage: Any = Usd.Stage.Open(str(path))
    primvar: Any = UsdGeom.PrimvarsAPI(stage.GetDefaultPrim()).GetPrimvar("tangents")
    assert primvar.GetInterpolation() == UsdGeom.Tokens.vertex
    for f, wanted in enumerate(tangents_of(SOURCE)):
        rows = np.array(primvar.Get(f))
        assert (rows[:, :3] == wanted).all()
        assert (rows[:, 3] == SOURCE.handedness).all()
    back = opened(files)
    assert tangents_of(back) == pytest.approx(tangents_of(SOURCE), abs=1e-6)
    assert np.array_equal(back.handedness, SOURCE.handedness)  # type: ignore[arg-type]


def rows(gltf: Any, number: int, width: int) -> AnyArray:
    accessor = gltf.accessors[number]
    view = gltf.bufferViews[accessor.bufferView]
    return np.frombuffer(gltf.binary_blob(), "<f4", accessor.count * width, view.byteOffset).reshape(-1, width)


def test_morph_targets_turn_them() -> None:
    """With a target per frame the sum of base and target points along each frame's own tangents."""
    source = cache(8, tangents=True)
    files, _ = written(source, "a.glb", WriteOptions(max_error=1e-6))
    gltf: Any = GLTF2().load_from_bytes(files.files["a.glb"])
    (primitive,) = gltf.meshes[0].primitives
    base = rows(gltf, primitive.attributes.TANGENT, 4)
    assert (base[:, 3] == source.handedness).all()
    moved = np.array([rows(gltf, target["TANGENT"], 3) for target in primitive.targets])
    weights = rows(gltf, gltf.animations[0].samplers[0].output, 1).reshape(-1, len(moved))
    played = base[:, :3] + np.einsum("fm,mvi->fvi", weights, moved)
    played /= np.linalg.norm(played, axis=2, keepdims=True)
    assert np.abs(played - tangents_of(source)).max() < 1e-3


@pytest.mark.parametrize("layout", ["flip-visibility", "flip-scale"])
def test_pages_of_a_flip_book_keep_them(layout: str) -> None:
    files, _ = written(SOURCE, "a.glb", WriteOptions(layout=layout))
    back = opened(files)
    assert (tangents_of(back) == tangents_of(SOURCE)).all()
    assert np.array_equal(back.handedness, SOURCE.handedness)  # type: ignore[arg-type]


@needs_validator
def test_the_validator_takes_them() -> None:
    layouts = ("morph", "flip-visibility", "flip-scale")
    files = [written(SOURCE, "a.glb", WriteOptions(layout=each))[0].files["a.glb"] for each in layouts]
    assert [errors(report) for report in validate_many(files)] == [[]] * len(files)


def test_they_turn_and_go_with_their_vertices() -> None:
    up = to_up_axis(SOURCE, "z")
    x, y, z = np.moveaxis(tangents_of(SOURCE), -1, 0)
    assert (tangents_of(up) == np.stack([x, -z, y], axis=-1)).all()
    fewer = reorder(SOURCE, "blender")
    assert (tangents_of(fewer) == tangents_of(SOURCE)[:, :8]).all()
    assert fewer.handedness is not None
    assert len(fewer.handedness) == 8
    between = tangents_of(at_time(SOURCE, 0.5 / 30))[0]
    middle = tangents_of(SOURCE)[:2].sum(axis=0)
    assert between == pytest.approx(middle / np.linalg.norm(middle, axis=1, keepdims=True), abs=1e-5)
