"""`anim.sample`, `optimize`, `diff` and `bake` against forward kinematics and files that are not their own."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import anim
import fixtures

Array = NDArray[np.float64]


@pytest.fixture
def biped(tmp_path: Path) -> Path:
    path = tmp_path / "biped.glb"
    path.write_bytes(fixtures.build("biped"))
    return path


def test_positions_are_those_of_forward_kinematics(biped: Path) -> None:
    content, binary = _glb(biped.read_bytes())
    found = anim.sample(biped, "walk", fps=30)
    times = np.append(np.arange(30) / 30, 1.0)
    assert found.shape == (31, len(content["nodes"]), 3)
    for frame, time in enumerate(times):
        np.testing.assert_allclose(found[frame], _positions(content, binary, "walk", time), atol=1e-6)


def test_times_may_be_given(biped: Path) -> None:
    asset = anim.load(biped)
    moments = [0.25, 0.5]
    np.testing.assert_allclose(anim.sample(asset, 0, times=moments), anim.sample(asset, "walk", fps=4)[1:3])
    assert anim.sample(asset, asset.clips["wave"]).shape[0] == len(asset.clips["wave"].tracks[0].times)
    assert anim.sample_poses(asset, "walk", fps=4, space="local").rotation.shape == (5, 22, 4)
    with pytest.raises(anim.RangeError, match="exclude"):
        anim.sample(asset, times=moments, fps=3)


def test_an_optimized_asset_keeps_its_bound_and_is_smaller(biped: Path, tmp_path: Path) -> None:
    result = anim.optimize(biped, max_error="1mm", effort="fast")
    result.save(tmp_path / "small.glb")
    assert (tmp_path / "small.glb").stat().st_size < biped.stat().st_size
    assert list(result.errors) == ["walk", "wave", "jump"]
    assert 0 < anim.diff(biped, tmp_path / "small.glb").max_error <= 0.001
    for _ in range(2):  # the sub-package must not replace the function
        assert callable(anim.optimize)
    with pytest.raises(anim.RangeError, match="bananas"):
        anim.optimize(biped, max_error="5 bananas")


def test_an_asset_within_a_number_of_bytes(biped: Path, tmp_path: Path) -> None:
    """Of the file as written, by the smallest error that fits."""
    limit = 264_000
    result = anim.optimize(biped, max_bytes="264kB", clips="wave", effort="fast")
    result.save(tmp_path / "fits.glb")
    assert (tmp_path / "fits.glb").stat().st_size <= limit
    apart = anim.diff(biped, tmp_path / "fits.glb", clips="wave").max_error
    assert 0 < apart <= result.max_error * (1 + 1e-6)
    with pytest.raises(
        anim.RangeError, match=r"max_bytes is 1000 \(expected at least \d+, for an error of up to 1e-06 m\)"
    ):
        anim.optimize(biped, max_bytes=1000, max_error=1e-6, clips="wave", effort="fast")


def test_a_missing_clip_is_infinitely_far(biped: Path) -> None:
    asset = anim.load(biped)
    one = {**asset.document.json, "animations": asset.document.json["animations"][:1]}
    assert anim.diff(asset, replace(asset.document, json=one)).max_error == float("inf")
    assert anim.diff(asset, asset, clips="wave").max_error == 0


def test_a_bake_is_saved_by_its_ending(biped: Path, tmp_path: Path) -> None:
    baked = anim.bake(biped, "walk", method="dqs", fps=4)
    baked.save(tmp_path / "walk.npz")
    with np.load(tmp_path / "walk.npz") as saved:
        assert max(saved[name].shape[0] for name in saved.files if saved[name].ndim == 3) == 5
    baked.save(tmp_path / "walk.pc2", up="z", vertex_order="blender")
    assert (tmp_path / "walk.pc2-rest.ply").is_file()
    with pytest.raises(anim.UnsupportedError, match="xyz"):
        baked.save(tmp_path / "walk.xyz")
    with pytest.raises(anim.RangeError, match="preset"):
        baked.save(tmp_path / "walk.npz", preset="godot")
    with pytest.raises(anim.OutputError):
        baked.save(tmp_path / "no" / "walk.npz")
    assert {path.name for path in tmp_path.iterdir()} == {"biped.glb", "walk.npz", "walk.pc2", "walk.pc2-rest.ply"}


def test_errors_have_a_key_for_each_clip_of_one_name(biped: Path) -> None:
    document = anim.load(biped).document
    animations = [{**each, "name": "walk"} for each in document.json["animations"]]
    result = anim.optimize(replace(document, json={**document.json, "animations": animations}), effort="fast")
    assert list(result.errors) == ["walk", "#1", "#2"]
    assert result.max_error == max(result.errors.values()) > 0


# Forward kinematics of a GLB, as the specification says it, from its bytes.


def _glb(data: bytes) -> tuple[dict[str, Any], bytes]:
    size = struct.unpack("<I", data[12:16])[0]
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def _accessor(content: dict[str, Any], binary: bytes, index: int) -> Array:
    about = content["accessors"][index]
    view = content["bufferViews"][about["bufferView"]]
    width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[about["type"]]
    assert about["componentType"] == 5126
    assert "byteStride" not in view
    start = view.get("byteOffset", 0) + about.get("byteOffset", 0)
    numbers = np.frombuffer(binary, "<f4", about["count"] * width, start)
    return numbers.reshape(-1, width).astype(float)


def _positions(content: dict[str, Any], binary: bytes, name: str, time: float) -> Array:
    nodes = [dict(node) for node in content["nodes"]]
    animation = next(each for each in content["animations"] if each["name"] == name)
    for channel in animation["channels"]:
        sampler = animation["samplers"][channel["sampler"]]
        assert sampler.get("interpolation", "LINEAR") == "LINEAR"
        times = _accessor(content, binary, sampler["input"])[:, 0]
        values = _accessor(content, binary, sampler["output"])
        k = int(np.clip(np.searchsorted(times, time, "right") - 1, 0, max(len(times) - 2, 0)))
        after = min(k + 1, len(times) - 1)
        u = float(np.clip((time - times[k]) / (times[after] - times[k]), 0, 1)) if after > k else 0.0
        mix = _slerp if channel["target"]["path"] == "rotation" else _lerp
        nodes[channel["target"]["node"]][channel["target"]["path"]] = mix(values[k], values[after], u)
    world: dict[int, Array] = {}
    parents = {child: i for i, node in enumerate(nodes) for child in node.get("children", ())}

    def matrix(i: int) -> Array:
        if i not in world:
            local = _matrix(nodes[i])
            world[i] = matrix(parents[i]) @ local if i in parents else local
        return world[i]

    return np.array([matrix(i)[:3, 3] for i in range(len(nodes))])


def _lerp(a: Array, b: Array, u: float) -> Array:
    return a + (b - a) * u


def _slerp(a: Array, b: Array, u: float) -> Array:
    b = b if a @ b >= 0 else -b
    angle = np.arccos(min(float(a @ b), 1.0))
    if angle < 1e-7:
        return _lerp(a, b, u)
    mixed: Array = (np.sin((1 - u) * angle) * a + np.sin(u * angle) * b) / np.sin(angle)
    return mixed


def _matrix(node: dict[str, Any]) -> Array:
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    x, y, z, w = np.array(node.get("rotation", (0, 0, 0, 1)), float) / np.linalg.norm(
        node.get("rotation", (0, 0, 0, 1))
    )
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    found = np.eye(4)
    found[:3, :3] = np.array(rows) * np.array(node.get("scale", (1, 1, 1)), float)
    found[:3, 3] = node.get("translation", (0, 0, 0))
    return found
