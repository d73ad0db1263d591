"""Morph weights by pointers to a mesh move the surface in every command, against cubes morphed by hand."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from anim.arrays import Floats
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.writing import writer
from anim.model import Clip, Track
from tests.cli.conftest import Call
from tests.files import glb_of, opened_fixture, opened_path

END = 2.0
TIMES = np.arange(0, END + 0.01, 1 / 30)
WEIGHTS = np.stack((0.5 + 0.5 * np.sin(5 * TIMES), 0.5 + 0.5 * np.cos(7 * TIMES)), axis=1)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Two cubes of one mesh, of which the second has weights of its own: a.glb, and still.glb without its motion."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.glb").write_bytes(glb_of(_document("/meshes/0/weights", WEIGHTS)))
    (tmp_path / "one.glb").write_bytes(glb_of(_document("/nodes/1/weights/1", WEIGHTS[:, 1:])))
    (tmp_path / "still.glb").write_bytes(glb_of(_document("/materials/0/alphaCutoff", WEIGHTS[:, :1])))
    return tmp_path


def _document(pointer: str, values: Floats) -> Document:
    document = opened_fixture("pointer")
    nodes = [dict(node) for node in document.json["nodes"]]
    del nodes[0]["weights"]
    json = {**document.json, "nodes": nodes, "animations": document.json["animations"][:1]}
    track = Track(None, "pointer", "LINEAR", TIMES, values, pointer=pointer)
    return writer.replace_clips(Document(json, document.buffers), {0: Clip("morph", (track,))})


def _cubes(path: Path, first: Floats, second: Floats) -> Floats:
    """Vertices of both cubes (F, 2 · V, 3) with weights (F, 2) or (2,) each."""
    cubes = []
    for instance, weights in zip(reader.scene(opened_path(path)).instances, (first, second), strict=True):
        moved = np.tensordot(np.broadcast_to(weights, (len(first), 2)), instance.mesh.targets, (1, 0))
        cubes.append(instance.mesh.positions + moved + [(-0.5, 0, 0), (0.5, 0, 0)][instance.node])
    return np.concatenate(cubes, axis=1)


def _interpolated(times: Floats) -> Floats:
    return np.stack([np.interp(times, TIMES, column) for column in WEIGHTS.T], axis=1)


def test_bakes_have_the_weights(folder: Path, call: Call) -> None:
    run = call("bake", "a.glb", "a.npz", "--fps", "24")
    assert "warning" not in run.err
    with np.load("a.npz") as file:
        times, points = file["times"], file["positions"]
    expected = _cubes(folder / "a.glb", _interpolated(times), np.zeros(2))
    np.testing.assert_allclose(points, expected, atol=1e-6)


@pytest.mark.parametrize("name", ["a.glb", "one.glb"])
def test_morph_bakes_keep_no_pointer_to_baked_weights(name: str, folder: Path, call: Call) -> None:
    call("bake", name, "out.glb").product()
    (clip,) = reader.clips(opened_path(folder / "out.glb"))
    assert {track.path for track in clip.tracks} == {"weights"}
    assert all(track.pointer is None for track in clip.tracks)


def test_errors_are_those_of_the_surface(folder: Path, call: Call) -> None:
    report = call("diff", "a.glb", "still.glb", "--format", "json").json
    points = _cubes(folder / "a.glb", _interpolated(np.linspace(0, END, 2001)), np.zeros(2))
    rest = _cubes(folder / "a.glb", np.zeros((1, 2)), np.zeros(2))
    truth = np.linalg.norm(points - rest, axis=-1).max()
    assert report["clips"][0]["max_error_m"] == pytest.approx(truth, rel=1e-3)
    assert call("diff", "a.glb", "still.glb", "--fail-above", "1mm").code == 6
    assert call("diff", "a.glb", "a.glb", "--fail-above", "0").code == 0


def test_optimize_keeps_its_bound(folder: Path, call: Call) -> None:
    run = call("optimize", "a.glb", "small.glb", "--max-error", "1cm", "--max-pointer-error", "50%", "--report", "-")
    report = json.loads(run.product())
    (clip,) = reader.clips(opened_path(folder / "small.glb"))
    times = np.linspace(0, END, 2001)
    found = np.stack([np.interp(times, clip.tracks[0].times, column) for column in clip.tracks[0].values.T], axis=1)
    moved = _cubes(folder / "a.glb", found, np.zeros(2)) - _cubes(folder / "a.glb", _interpolated(times), np.zeros(2))
    truth = float(np.linalg.norm(moved, axis=-1).max())
    assert clip.tracks[0].pointer == "/meshes/0/weights"
    assert len(clip.tracks[0].times) < len(TIMES)
    assert 0.001 < truth <= 0.01
    assert report["clips"][0]["max_error_m"] == pytest.approx(truth, rel=0.01)
    assert report["clips"][0]["max_pointer_error"] == 0


def test_seams_are_those_of_the_surface(folder: Path, call: Call) -> None:
    gap = call("loop", "a.glb", "--format", "json").json["loops"][0]["seam_m"]
    ends = _cubes(folder / "a.glb", WEIGHTS[[0, -1]], np.zeros(2))
    assert gap == pytest.approx(np.linalg.norm(ends[1] - ends[0], axis=-1).max(), rel=1e-5)


def test_usd_has_the_weights_without_a_pointer(folder: Path, call: Call) -> None:
    pytest.importorskip("pxr")
    run = call("convert", "a.glb", "a.usda")
    assert "KHR_animation_pointer" not in run.err
    assert "max 0 mm" not in run.err
    assert "a.usda" in run.err


def test_equal_pointers_at_weights_that_a_node_replaces_differ(call: Call, tmp_path: Path) -> None:
    """The tracks are equal, and so are the nodes at rest, but only in one file the mesh's weights move the node."""
    for name, own in (("a", None), ("b", [0.0, 0.75, 0.0])):
        document = opened_fixture("morph_cube")
        content = document.json
        content["extensionsUsed"] = ["KHR_animation_pointer"]
        del content["nodes"][0]["weights"]
        if own is not None:
            content["nodes"][0]["weights"] = own
        pointer = {"KHR_animation_pointer": {"pointer": "/meshes/0/weights"}}
        for animation in content["animations"]:
            animation["channels"][0]["target"] = {"path": "pointer", "extensions": pointer}
        (tmp_path / f"{name}.glb").write_bytes(glb_of(document))
    found = call("diff", tmp_path / "a.glb", tmp_path / "b.glb", "--format", "json").json
    assert all(each["max_error_m"] > 0.01 for each in found["clips"])
    assert call("diff", tmp_path / "b.glb", tmp_path / "b.glb", "--format", "json").json["max_error_m"] == 0
