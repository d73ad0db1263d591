"""Caches and Euler curves on the page: the vertices and joints that other routes give."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from anim.arrays import Floats
from anim.caches.transforms.up_axis import to_up_axis
from anim.errors import AnimError, RangeError, UnsupportedError
from anim.exchange.euler.from_euler import from_euler
from anim.exchange.euler.motion import scale_motion
from anim.exchange.formats import bvh_reader
from anim.gltf.reading import reader
from anim.model import FrameChunk, VertexCache
from anim.sampling import PoseSampler
from anim.show.page import sources
from anim.show.page.embedding import embed
from anim.show.page.sources import convert_cache, read_curves
from anim.skinning.bake import bake
from tests.files import opened, opened_fixture
from tests.judge import needs_judge, vertices

BVH = b"""HIERARCHY
ROOT hips
{
  OFFSET 0 90 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT </script>
  {
    OFFSET 0 80 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    { OFFSET 0 0 10 }
  }
}
MOTION
Frames: 3
Frame Time: 0.1
0 90 0 0 0 0 0 0 0
5 90 0 10 0 0 0 20 0
10 90 0 20 0 0 0 40 0
"""
CSV = b"# order=XYZ frame=intrinsic unit=deg\ntime,door.rx,door.ry,door.rz\n0,0,0,0\n1,0,90,0\n"


def _cache(positions: Floats, faces: list[list[int]]) -> VertexCache:
    rows = positions.astype(np.float32)

    def chunks() -> Iterator[FrameChunk]:
        yield FrameChunk(0, rows)

    times = np.arange(len(rows)) / 10
    return VertexCache(times, rows.shape[1], np.array(faces, np.int64).reshape(-1, 3), chunks)


@needs_judge
@pytest.mark.parametrize("up", ["y", "z"])
def test_three_shows_the_vertices_of_a_cache(up: str, tmp_path: Path) -> None:
    document = opened_fixture("biped")
    scene, clip = reader.scene(document), reader.clips(document)[0]
    cache = bake(scene, clip, times=np.linspace(clip.start, clip.end, 9))
    found = convert_cache(to_up_axis(cache, up), "walk </script>")
    whole = cache.load_all().positions
    size = float(np.linalg.norm(np.ptp(whole.reshape(-1, 3), axis=0)))
    (tmp_path / "page.glb").write_bytes(embed(found.document).glb)
    seen = vertices(tmp_path / "page.glb", clip=0, time=float(cache.times[5]))
    assert np.abs(seen - whole[5]).max() < 2e-3 * size
    assert found.document.json["animations"][0]["name"] == "walk </script>"
    assert found.notes[0].startswith("morph targets: within ")


@needs_judge
def test_a_cache_of_noise_becomes_a_flip_book(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    noise = np.random.default_rng(1).normal(size=(300, 290, 3))
    cache = _cache(noise, [[0, 1, 2]])
    found = convert_cache(cache)
    assert len(found.document.json["nodes"]) > 300
    (tmp_path / "page.glb").write_bytes(embed(found.document).glb)
    seen = vertices(tmp_path / "page.glb", clip=0, time=12.5).reshape(300, 290, 3)
    assert np.array_equal(seen[125], noise[125].astype(np.float32))
    assert not seen[np.arange(300) != 125].any()
    monkeypatch.setattr(sources, "MAX_FLIPBOOK_BYTES", 1000)
    with pytest.raises(UnsupportedError, match="300 frames of 290 vertices are too many for a page"):
        convert_cache(cache)


@pytest.mark.parametrize(("frames", "faces"), [(1, [[0, 1, 2]]), (3, [])])
def test_one_frame_and_points(frames: int, faces: list[list[int]]) -> None:
    found = convert_cache(_cache(np.arange(frames * 9.0).reshape(frames, 3, 3), faces))
    assert len(reader.clips(opened(embed(found.document).glb))) == (frames > 1)


def test_a_large_cache_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sources, "MAX_CACHE_BYTES", 10)
    with pytest.raises(UnsupportedError, match="too many for a page"):
        convert_cache(_cache(np.zeros((2, 3, 3)), [[0, 1, 2]]))


def test_sticks_follow_the_joints_of_a_bvh() -> None:
    found = read_curves(BVH, name="takes/walk.bvh")
    motion = bvh_reader.read(BVH)
    made = from_euler(scale_motion(motion, 0.0254), tolerance=1e-3)
    document = opened(embed(found.document).glb)
    scene, clip = reader.scene(document), reader.clips(document)[0]
    assert "</script>" in scene.skeleton.names
    assert clip.name == "walk"
    frames = bake(scene, clip, times=np.array([0.0, 0.2])).load_all().positions
    joints = PoseSampler(made.skeleton, made.clip).posed(np.array([0.0, 0.2])).world[:, :, :, 3].swapaxes(0, 1)
    for frame, places in zip(frames, joints, strict=True):
        starts = frame.reshape(-1, 24, 3)[:, 0]
        assert np.linalg.norm(starts[:, None] - places[:2], axis=-1).min(axis=0).max() < 1e-5
    assert found.notes[-1] == "0.0254 m per unit, guessed: inches"


def test_curves_without_a_hierarchy_have_a_stick_each() -> None:
    found = read_curves(CSV, name="door.csv")
    assert len(found.document.json["meshes"]) == 1
    assert not found.notes
    assert [clip.name for clip in reader.clips(read_curves(CSV).document)] == ["motion"]


@pytest.mark.parametrize(
    ("data", "name", "problem"),
    [
        (CSV.replace(b"order=XYZ", b""), "door.csv", "order"),
        (b"time,door.rx\n", "door.csv", "no rows"),
        (b"", "a.bvh", "HIERARCHY|empty"),
        (b"\x00\x01", "a", "starts with"),
    ],
)
def test_wrong_curves_are_refused(data: bytes, name: str, problem: str) -> None:
    with pytest.raises(AnimError, match=problem) as caught:
        read_curves(data, name=name)
    assert isinstance(caught.value, AnimError if "order" not in problem else RangeError)


@needs_judge
def test_a_file_without_a_mesh_is_shown_as_sticks(tmp_path: Path) -> None:
    document = opened_fixture("biped")
    nodes = [{key: value for key, value in node.items() if key != "mesh"} for node in document.json["nodes"]]
    bare = replace(document, json={**document.json, "nodes": nodes})
    found = embed(bare)
    assert found.notes == ["no mesh: shown as sticks from joint to joint"]
    (tmp_path / "page.glb").write_bytes(found.glb)
    shown = vertices(tmp_path / "page.glb", clip=0, time=0.25)
    made = opened(found.glb)
    scene, clip = reader.scene(made), reader.clips(made)[0]
    mine = bake(scene, clip, times=np.array([0.25])).load_all().positions[0]
    assert len(shown) % 24 == 0
    assert np.allclose(shown, mine, atol=1e-5)


def test_a_single_node_beside_a_skeleton_has_no_stick() -> None:
    nodes = [
        {"name": "hips", "children": [1]},
        {"translation": [0, 1, 0]},
        {"name": "look at", "translation": [0, 0, 9]},
    ]
    data = json.dumps({"asset": {"version": "2.0"}, "nodes": nodes, "scenes": [{"nodes": [0, 2]}]}).encode()
    made = opened(embed(opened(data)).glb)
    assert np.abs(reader.scene(made).instances[0].mesh.positions).max() == pytest.approx(1)
    alone = json.dumps({"asset": {"version": "2.0"}, "nodes": nodes[2:] * 2, "scenes": [{"nodes": [0, 1]}]}).encode()
    assert len(opened(embed(opened(alone)).glb).json["meshes"]) == 2
