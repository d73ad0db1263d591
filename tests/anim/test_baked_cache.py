"""`BakedCache.save` keeps the materials of the asset that was baked, as `bake` of the command line does."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import pytest

import anim
from anim.model import Clip
from cli import main
from tests.files import opened_path
from tests.textured import looks, textured


@pytest.fixture
def source(tmp_path: Path) -> anim.Asset:
    (tmp_path / "source.glb").write_bytes(textured())
    return anim.load(tmp_path / "source.glb")


@pytest.mark.parametrize("ending", ["glb", "usda", "abc", "obj"])
@pytest.mark.parametrize("options", [{}, {"space": "mesh"}, {"rigid": True, "meshes": "strip"}])
def test_a_bake_keeps_the_materials_of_its_asset(
    source: anim.Asset, tmp_path: Path, ending: str, options: dict[str, Any]
) -> None:
    """As `bake` of the command line, byte for byte; a cache that was pickled too."""
    pytest.importorskip({"usda": "pxr", "abc": "alembic3d"}.get(ending, "numpy"))
    ours, theirs = tmp_path / f"out.{ending}", tmp_path / "cli" / f"out.{ending}"
    theirs.parent.mkdir()
    has_normals = ending != "obj"
    has_tangents = has_normals and ending != "abc"
    baked = anim.bake(source, "bend", fps=4, normals=has_normals, tangents=has_tangents, **options)
    baked.save(ours)
    words = ["--normals"] * has_normals + ["--vertex-tangents"] * has_tangents
    for name, value in options.items():
        words += [f"--{name}".removesuffix("es")] + ([] if value is True else [value])
    assert main.run(["bake", str(tmp_path / "source.glb"), str(theirs), "--clip", "bend", "--fps", "4", *words]) == 0
    written = {path.name: path.read_bytes() for path in theirs.parent.iterdir()}
    for cache in (baked, pickle.loads(pickle.dumps(baked))):
        cache.save(ours)
        assert {path.name: path.read_bytes() for path in tmp_path.glob("out*")} == written


def test_a_bake_without_materials(source: anim.Asset, tmp_path: Path) -> None:
    baked = anim.bake(source, "bend", fps=4)
    baked.save(tmp_path / "out.glb", materials=False)
    assert "images" not in opened_path(tmp_path / "out.glb").json
    baked.save(tmp_path / "out.npz")
    with pytest.raises(anim.RangeError, match="all vertices in the order of the file") as caught:
        baked.save(tmp_path / "blender.glb", vertex_order="blender")
    assert "materials" in str(caught.value.help)
    baked.save(tmp_path / "blender.glb", vertex_order="blender", materials=False)
    with pytest.raises(anim.UnsupportedError, match=r"\.xyz"):  # before the vertices are compared
        baked.save(tmp_path / "blender.xyz", vertex_order="blender")


def test_a_bake_keeps_the_clip_that_was_baked(source: anim.Asset, tmp_path: Path) -> None:
    """Other nodes move as in it: cut to given times, or changed in Python; the asset may change later."""
    out = tmp_path / "out.glb"

    def times(path: Path) -> list[tuple[str, float, float]]:
        clips = anim.load(path).clips
        return [(clip.name, round(float(clip.start), 6), round(float(clip.end), 6)) for clip in clips]

    anim.bake(source, "bend", times=[0.25, 0.4, 0.75]).save(out)
    assert times(out) == [("bend", 0.25, 0.75)]
    slow = anim.ops.retime(source.clips["bend"], speed=0.5)
    baked = anim.bake(source, Clip("slow", slow.tracks), fps=4)
    source.document.json["materials"].clear()
    baked.save(out)
    assert times(out) == [("slow", 0, 2)]
    assert len(opened_path(out).json["materials"]) == 2
    (flag,) = (track for track in anim.load(out).clips["slow"].tracks if track.node == 5)
    assert flag.times[-1] == 2


def test_a_bake_onto_another_asset(source: anim.Asset, tmp_path: Path) -> None:
    baked = anim.bake(source, "bend", fps=4)
    baked.save(tmp_path / "out.glb", onto=source)
    assert looks(opened_path(tmp_path / "out.glb")) == looks(source.document)
    with pytest.raises(anim.RangeError, match=r"`onto` does not apply to \.npz"):
        baked.save(tmp_path / "out.npz", onto=source)
