"""`bake`: vertex caches from files, one per clip, by every method; and what it says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from anim.caches.registry import CACHE_FORMATS, Files
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.sampling import sample_pose, world_matrices
from anim.sampling.times import frame_times
from anim.skinning.bake import bake as baked
from tests.cli.conftest import Call, Find, Fixture
from tests.cli.running import help_line, refusal, shell
from tests.files import glb_of, opened_fixture, opened_path


def test_what_it_writes_is_what_the_library_bakes(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    source, out = fixture("arm"), tmp_path / "arm.npz"
    run = call("bake", source, out, "--clip", "twist", "--method", "dqs", "--fps", 24, "--normals")
    assert run.out == b""
    assert run.code == 0
    assert run.err.startswith(f"{out}  ")
    assert "dqs of 'twist', 25 frames of 530 vertices" in run.err
    document = opened_fixture("arm")
    twist = next(clip for clip in reader.clips(document) if clip.name == "twist")
    cache = baked(
        reader.scene(document, normals=True), twist, times=frame_times(0, 1, fps=24), method="dqs", normals=True
    )
    found, whole = np.load(out), cache.load_all()
    assert np.array_equal(found["positions"], whole.positions)
    assert np.array_equal(found["normals"], whole.normals)  # type: ignore[arg-type]
    assert np.array_equal(found["faces"], cache.faces)
    assert np.array_equal(found["times"], cache.times)
    assert found["positions"].dtype == np.float32


def test_keys_are_the_frames_without_a_rate(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    out = tmp_path / "tube.npz"
    assert call("bake", fixture("tube"), out, "--clip", "twist180").code == 0
    assert np.load(out)["times"].tolist() == [0, 0.5, 1]


@pytest.mark.parametrize("ending", ["pc2", "png", "npz"])
def test_a_range_too_short_for_two_frames_is_one(ending: str, call: Call, fixture: Fixture, tmp_path: Path) -> None:
    range_s = ("--from", "0.5", "--to", "0.5000001", "--fps", "4")
    run = call("bake", fixture("tube"), tmp_path / f"a.{ending}", "--clip", "twist180", *range_s)
    assert ", 1 frame of " in run.err


def test_several_clips_need_a_place_for_their_names(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    source = fixture("arm")
    run = call("bake", source, tmp_path / "arm.npz")
    assert "2 clips are chosen, but" in refusal(run, 2)
    assert help_line(run) == "choose one with --clip, or put {clip} into OUT for a file per clip"
    run = call("bake", source, tmp_path / "arm-{clip}.npz", "-v", "--fps", 24)
    assert run.code == 0
    assert sorted(path.name for path in tmp_path.glob("*.npz")) == ["arm-bend.npz", "arm-twist.npz"]
    assert run.err.splitlines()[-1].startswith("2 clips, ")
    assert len(run.err.splitlines()) == 3


def test_meshes_and_clips_are_counted_apart(call: Call, tmp_path: Path) -> None:
    document = opened_fixture("arm")
    node = next(node for node in document.json["nodes"] if "skin" in node)
    nodes = [*document.json["nodes"], {**node, "name": "second"}]
    scenes = [{"nodes": [*document.json["scenes"][0]["nodes"], len(nodes) - 1]}]
    json = {**document.json, "nodes": nodes, "scenes": scenes}
    (tmp_path / "two.glb").write_bytes(glb_of(Document(json, document.buffers)))
    run = call("bake", tmp_path / "two.glb", tmp_path / "{mesh}.mdd", "--fps", 12, "--clip", "bend")
    assert run.err.splitlines()[-1].startswith("2 meshes of 1 clip, ")
    run = call("bake", tmp_path / "two.glb", tmp_path / "{mesh}-{clip}.mdd", "--fps", 12)
    assert run.err.splitlines()[-1].startswith("2 meshes of 2 clips, ")


def test_names_that_no_file_can_have(call: Call, tmp_path: Path) -> None:
    document = opened_fixture("arm")
    names = ["a/b:c", "a/b:c"]
    animations = [{**each, "name": name} for each, name in zip(document.json["animations"], names, strict=True)]
    (tmp_path / "odd.glb").write_bytes(glb_of(Document({**document.json, "animations": animations}, document.buffers)))
    assert call("bake", tmp_path / "odd.glb", tmp_path / "{clip}.npz", "-q").code == 0
    assert sorted(path.name for path in tmp_path.glob("*.npz")) == ["a_b_c-1.npz", "a_b_c.npz"]
    animations = [{**each, "name": name} for each, name in zip(animations, ("Walk", "walk"), strict=True)]
    (tmp_path / "odd.glb").write_bytes(glb_of(Document({**document.json, "animations": animations}, document.buffers)))
    assert call("bake", tmp_path / "odd.glb", tmp_path / "{clip}.pc2", "--fps", 9, "-q").code == 0
    assert sorted(path.name for path in tmp_path.glob("*.pc2")) == ["Walk.pc2", "walk-1.pc2"]
    three = [{**animations[0], "name": name} for name in ("a-2", "a", "a")]
    (tmp_path / "odd.glb").write_bytes(glb_of(Document({**document.json, "animations": three}, document.buffers)))
    assert call("bake", tmp_path / "odd.glb", tmp_path / "{clip}.mdd", "--fps", 9, "-q").code == 0
    assert sorted(path.name for path in tmp_path.glob("*.mdd")) == ["a-2-2.mdd", "a-2.mdd", "a.mdd"]


def test_every_format_is_written(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    source = fixture("arm")
    for ending in (ending for ending, each in CACHE_FORMATS.items() if each.files is Files.ONE):
        run = call("bake", source, tmp_path / f"out{ending}", "--clip", "bend", "--fps", 5)
        assert run.code == 0, run.err
        assert (tmp_path / f"out{ending}").stat().st_size > 530 * 3 * 4
    data = np.fromfile(tmp_path / "out.pc2", "<f4", offset=32).reshape(6, 530, 3)
    assert np.array_equal(data, np.load(tmp_path / "out.npz")["positions"])


def test_up_and_order_are_blenders(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    source = fixture("arm")
    for name, more in (("y", ()), ("z", ("--up", "z", "--vertex-order", "blender"))):
        assert call("bake", source, tmp_path / f"{name}.npz", "--clip", "bend", *more).code == 0
    y, z = (np.load(tmp_path / f"{name}.npz")["positions"] for name in "yz")
    assert np.array_equal(z, y[..., [0, 2, 1]] * np.array([1, -1, 1], np.float32))


def test_pipes(fixture: Fixture, tmp_path: Path) -> None:
    fixture("arm")
    line = "cat arm.glb | gltf-anim bake --clip twist --method cor | gltf-anim convert-cache - out.mdd"
    assert shell(line, tmp_path).code == 0
    assert (tmp_path / "out.mdd").stat().st_size == 8 + 2 * 4 + 2 * 530 * 12


def test_dry_runs_write_nothing(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    run = call("bake", fixture("arm"), tmp_path / "arm.npz", "--clip", "twist", "-n")
    assert run.err.endswith("(dry run: nothing written)\n")
    assert not list(tmp_path.glob("*.npz"))


def test_same_input_same_bytes(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    source = fixture("biped")
    for name in "ab":
        assert call("bake", source, tmp_path / f"{name}.npz", "--clip", "walk", "--method", "dqs").code == 0
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_no_clip_is_the_rest_pose(call: Call, tmp_path: Path) -> None:
    document = opened_fixture("arm")
    json = {key: value for key, value in document.json.items() if key != "animations"}
    (tmp_path / "still.glb").write_bytes(glb_of(Document(json, document.buffers)))
    run = call("bake", tmp_path / "still.glb", tmp_path / "still.npz")
    assert run.code == 0, run.err
    assert np.load(tmp_path / "still.npz")["times"].tolist() == [0]


def test_folders_of_names_with_clips_are_made(fixture: Fixture, tmp_path: Path, call: Call) -> None:
    out = tmp_path / "{mesh}" / "{clip}"
    assert call("bake", fixture("arm"), out / "a.npz", "--dry-run").code == 0
    assert not list(tmp_path.glob("arm"))
    assert call("bake", fixture("arm"), out / "a.npz").code == 0
    found = tmp_path.rglob("*.npz")
    assert sorted(path.relative_to(tmp_path).as_posix() for path in found) == ["arm/bend/a.npz", "arm/twist/a.npz"]
    refused = call("bake", fixture("arm"), tmp_path / "new" / "{clip}.glb", "--fps", 20_000)
    assert (refused.code, (tmp_path / "new").exists()) == (4, False)
    assert "there is no folder" in refusal(call("bake", fixture("arm"), tmp_path / "new/a.npz", "--clip", "bend"), 3)


def test_rigid_meshes_only_on_request(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    source = fixture("interpolations")
    run = call("bake", source, tmp_path / "{clip}.npz")
    assert "there is no mesh with a skin or morph targets" in refusal(run, 5)
    assert "--rigid" in help_line(run)
    assert call("bake", source, tmp_path / "{clip}.npz", "--rigid").code == 0


def test_a_mesh_is_chosen_by_its_own_name_or_its_nodes(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    for name in ("arm", "arm_mesh"):
        assert call("bake", fixture("arm"), tmp_path / f"{name}.npz", "--clip", "twist", "--mesh", name).code == 0
    assert (tmp_path / "arm.npz").read_bytes() == (tmp_path / "arm_mesh.npz").read_bytes()
    run = call("bake", fixture("arm"), tmp_path / "{clip}.npz", "--mesh", "zzz")
    assert help_line(run) == "the meshes are 'arm', 'arm_mesh'"


@pytest.mark.parametrize(
    ("args", "code", "words"),
    [
        (("--fps", "0"), 2, "--fps is 0 (expected a number above 0)"),
        (("--method", "lsb"), 2, "'lsb' is none of lbs, dqs, cor"),
        (("--blend-weight", "0.5"), 2, "--blend-weight requires a method other than lbs"),
        (("--method", "dqs", "--blend-weight", "2"), 2, "2 is too large (expected at most 1)"),
        (("--mesh", "hand"), 5, "no mesh matches 'hand'"),
        (("--clip", "twits"), 5, "no clip matches 'twits'"),
        (("--quantize",), 2, "--quantize does not apply to .npz"),
        (("--vertex-tangents",), 4, "has no tangents"),
    ],
)
def test_refusals(args: tuple[str, ...], code: int, words: str, call: Call, fixture: Fixture, tmp_path: Path) -> None:
    assert words in refusal(call("bake", fixture("arm"), tmp_path / "{clip}.npz", *args), code)
    assert not list(tmp_path.glob("*.npz"))


@pytest.mark.parametrize(
    ("option", "name"), [("--normals", "a.pc2"), ("--normals", "a.stl"), ("--vertex-tangents", "a.ply")]
)
def test_what_a_format_has_no_place_for(option: str, name: str, call: Call, fixture: Fixture, tmp_path: Path) -> None:
    run = call("bake", fixture("arm"), tmp_path / name, "--clip", "twist", option)
    assert f"{option} does not apply to {name[1:]}" in refusal(run, 2)
    assert not (tmp_path / name).exists()


@pytest.mark.slow
def test_tangents_of_a_real_file(call: Call, asset: Find, tmp_path: Path) -> None:
    """Rigid nodes turn them as they turn the file's own: checked by a product with the nodes' matrices."""
    source = asset("BusterDrone/busterDrone.gltf")
    call("bake", source, tmp_path / "a.npz", "--rigid", "--vertex-tangents", "--fps", "1").product()
    document = opened_path(source)
    of, (played,) = reader.scene(document, tangents=True), reader.clips(document)
    with np.load(tmp_path / "a.npz") as arrays:
        found, times, handedness = arrays["tangents"], arrays["times"], arrays["handedness"]
    world = world_matrices(of.skeleton, sample_pose(of.skeleton, played, times))
    at = 0
    for instance in of.instances:
        own = instance.mesh.tangents
        assert own is not None
        wanted = np.einsum("fij,vj->fvi", world[:, instance.node, :, :3], own[:, :3])
        wanted /= np.maximum(np.linalg.norm(wanted, axis=2, keepdims=True), 1e-30)
        assert np.abs(found[:, at : at + len(own)] - wanted).max() < 1e-5
        assert np.array_equal(handedness[at : at + len(own)], np.sign(own[:, 3]))
        at += len(own)


def test_an_output_of_no_format(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    assert "unsupported cache format '.fbx'" in refusal(call("bake", fixture("arm"), tmp_path / "arm.fbx"), 2)


@pytest.mark.parametrize("name", sorted(["skin/ibm_invalid_count.gltf", "skin/unresolved_joint.gltf"]))
def test_bad_files_are_refused(name: str, call: Call, bad_input: Find, tmp_path: Path) -> None:
    refusal(call("bake", bad_input(name), tmp_path / "out.npz"), 3)


def test_a_real_file_with_every_clip(call: Call, asset: Find, tmp_path: Path) -> None:
    source = asset("Fox.glb")
    assert call("bake", source, tmp_path / "{clip}.npz", "--method", "dqs", "-q").code == 0
    for each in reader.clips(opened_path(source)):
        positions = np.load(tmp_path / f"{each.name}.npz")["positions"]
        assert positions.shape[1:] == (1728, 3)
        assert np.isfinite(positions).all()


def test_unnamed_meshes_are_chosen_by_their_node(call: Call, tmp_path: Path) -> None:
    """ "#3" was the third of the names of meshes and nodes, another mesh than "3" without a word."""
    document = opened_fixture("arm")
    nodes = [{**each, "name": ""} for each in document.json["nodes"]]
    nodes += [{"mesh": 0, "translation": [x, 0, 0]} for x in (10, 20, 30)]
    meshes = [{**each, "name": ""} for each in document.json["meshes"]]
    changes = {"nodes": nodes, "meshes": meshes, "scenes": [{"nodes": [0, 2, 3, 4, 5]}]}
    path, out = tmp_path / "unnamed.glb", tmp_path / "x.npz"
    path.write_bytes(glb_of(replace(document, json={**document.json, **changes})))
    for glob, x in (("#3", 10), ("4", 20), ("#5", 30)):
        assert call("bake", path, out, "--clip", "bend", "--rigid", "--mesh", glob, "--fps", 1).code == 0
        assert abs(np.load(out)["positions"][0, :, 0].mean() - x) < 2
    assert "no mesh matches '#0'" in refusal(call("bake", path, out, "--clip", "bend", "--mesh", "#0"), 5)
