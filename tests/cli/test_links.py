"""A file that is named through a link: all that belongs to it lies where the link leads to."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import fixtures
from anim.gltf.io import images
from tests.calls import count_calls
from tests.cli.conftest import Call
from tests.cli.running import built, refusal, shell


@pytest.fixture
def folders(tmp_path: Path) -> tuple[Path, Path]:
    """Two folders, `real` and `links`."""
    for name in ("real", "links"):
        (tmp_path / name).mkdir()
    return tmp_path / "real", tmp_path / "links"


@pytest.mark.parametrize("before", ["nothing", "a pair", "a pair in the folder of the link"])
def test_a_pair_is_written_where_its_link_leads_to(
    before: str, call: Call, walk: Path, folders: tuple[Path, Path]
) -> None:
    real, linked = folders
    link = linked / "q.gltf"
    if before == "a pair in the folder of the link":
        call("convert", walk, link).product()
        link.rename(real / "q.gltf")
    elif before == "a pair":
        call("convert", walk, real / "q.gltf").product()
    there = sorted(path.name for path in linked.iterdir())
    link.symlink_to("../real/q.gltf")
    call("resample", walk, link, "--fps", "9").product()
    expected = call("resample", walk, "--fps", "9").product()
    for path in (real / "q.gltf", link):
        assert call("convert", path).product() == expected
    assert link.is_symlink()
    assert sorted(path.name for path in linked.iterdir()) == sorted([*there, "q.gltf"])
    assert len(list(real.iterdir())) == 2  # the buffer of before is gone, with its file


def test_a_pair_that_is_its_own_output_through_a_link(call: Call, walk: Path, folders: tuple[Path, Path]) -> None:
    real, linked = folders
    call("convert", walk, real / "q.gltf").product()
    (linked / "q.gltf").symlink_to(real / "q.gltf")
    call("resample", linked / "q.gltf", linked / "q.gltf", "--fps", "9").product()
    assert call("convert", real / "q.gltf").product() == call("resample", walk, "--fps", "9").product()
    assert len(list(real.iterdir())) == 2


@pytest.mark.parametrize("out", ["q.gltf", "q.glb"])
def test_images_go_where_the_link_leads_to(out: str, call: Call, tmp_path: Path, folders: tuple[Path, Path]) -> None:
    real, linked = folders
    (tmp_path / "skin.png").write_bytes(b"\x89PNG")
    scene = tmp_path / "scene.gltf"
    scene.write_text(json.dumps({"asset": {"version": "2.0"}, "images": [{"uri": "skin.png"}]}))
    (linked / out).symlink_to(real / out)
    call("convert", scene, linked / out).product()
    assert sorted(path.name for path in real.iterdir()) == [out, "skin.png"]
    assert [path.name for path in linked.iterdir()] == [out]


def test_a_link_does_not_open_other_folders(call: Call, folders: tuple[Path, Path]) -> None:
    real, linked = folders
    (linked / "q.bin").write_bytes(b"four")
    (real / "q.gltf").write_text(
        json.dumps({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4, "uri": "q.bin"}]})
    )
    (linked / "q.gltf").symlink_to(real / "q.gltf")
    assert "'q.bin' is not beside the file" in refusal(call("convert", linked / "q.gltf"), 3)
    (real / "q.bin").symlink_to(linked / "q.bin")
    assert "'q.bin' leads out of the file's folder" in refusal(call("convert", linked / "q.gltf"), 3)


def test_a_text_file_needs_a_folder(call: Call, walk: Path, tmp_path: Path) -> None:
    (tmp_path / "null.gltf").symlink_to("/dev/null")
    run = call("convert", walk, tmp_path / "null.gltf", "--dry-run")
    assert "null.gltf: is no plain file" in refusal(run, 3)


def test_a_cache_and_its_companions_go_where_the_link_leads_to(
    call: Call, walk: Path, folders: tuple[Path, Path]
) -> None:
    real, linked = folders
    line = ["--clip", "#0", "--fps", "4"]
    call("bake", walk, linked / "plain.pc2", *line).product()
    names = sorted(path.name.removeprefix("plain") for path in linked.iterdir())
    assert len(names) > 1
    (linked / "c.pc2").symlink_to("../real/c.pc2")
    call("bake", walk, linked / "c.pc2", *line).product()
    assert sorted(path.name.removeprefix("c") for path in real.iterdir()) == names
    assert [path.name for path in linked.iterdir() if path.name.startswith("c")] == ["c.pc2"]
    for path in (real / "c.pc2", linked / "c.pc2", linked / "plain.pc2"):
        call("convert-cache", path, path.with_suffix(".npz")).product()
    same = (linked / "plain.npz").read_bytes()
    assert (real / "c.npz").read_bytes() == (linked / "c.npz").read_bytes() == same


def test_a_companion_that_is_a_link_is_replaced(call: Call, walk: Path, folders: tuple[Path, Path]) -> None:
    """What it leads to may belong to another cache."""
    real, linked = folders
    line = ["--clip", "#0", "--fps", "4"]
    call("bake", walk, real / "c.pc2", *line).product()
    companions = [path.name for path in real.iterdir() if path.name != "c.pc2"]
    for name in companions:
        (real / name).write_bytes(b"of another")
        (linked / name).symlink_to(real / name)
    call("bake", walk, linked / "c.pc2", *line).product()
    assert [(real / name).read_bytes() for name in companions] == [b"of another"] * len(companions)
    assert not any((linked / name).is_symlink() for name in companions)


def test_frames_go_where_the_link_leads_to(call: Call, walk: Path, folders: tuple[Path, Path]) -> None:
    real, linked = folders
    (linked / "c.ply").symlink_to(real / "d.ply")
    call("bake", walk, linked / "c.ply", "--clip", "#0", "--fps", "4").product()
    assert [path.name for path in linked.iterdir()] == ["c.ply"]
    assert len(list(real.glob("d*.ply"))) > 2
    call("convert-cache", linked / "c.ply", linked / "c.npz").product()


def test_links_of_the_system_are_written_into(tmp_path: Path) -> None:
    (tmp_path / "walk.glb").write_bytes(built("biped"))
    run = shell("gltf-anim convert - /dev/stdout < walk.glb | cat", tmp_path)
    assert run.product() == fixtures.build("biped")


@pytest.mark.parametrize("line", ["bake {} l.npz", "convert {} l.gltf", "resample {} l.gltf --fps 4", "bake {} l.ply"])
def test_an_input_is_not_replaced_by_another_format_through_a_link(
    line: str, call: Call, walk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    before, out = walk.read_bytes(), line.split()[2]
    Path(out).symlink_to(walk)
    assert "is a link to an input of another format" in refusal(call(*line.format(walk).split()), 2)
    assert walk.read_bytes() == before
    Path("l.glb").symlink_to(walk)
    call("resample", walk, "l.glb", "--fps", "4").product()
    assert walk.read_bytes() != before


@pytest.mark.parametrize("ending", ["npz", "pc2", "gltf"])
def test_an_input_is_not_replaced_through_a_link_with_the_name_of_a_clip(
    ending: str, call: Call, walk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    before = walk.read_bytes()
    clip = json.loads(call("inspect", walk, "--format", "json").text)["files"][0]["clips"][0]["name"]
    Path(f"{clip}.{ending}").symlink_to(walk)
    assert "replaced through a link" in refusal(call("bake", walk, f"{{clip}}.{ending}", "--clip", clip), 2)
    assert walk.read_bytes() == before


def test_a_link_into_a_store_of_other_names_is_edited_in_place(
    call: Call, walk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    walk.rename("ab12")
    Path("f.glb").symlink_to("ab12")
    call("resample", "f.glb", "f.glb", "--fps", "4").product()
    assert Path("f.glb").is_symlink()


def test_no_image_is_copied_beside_a_device(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "skin.png").write_bytes(b"\x89PNG")
    scene = tmp_path / "scene.gltf"
    scene.write_text(json.dumps({"asset": {"version": "2.0"}, "images": [{"uri": "skin.png"}]}))
    copied = count_calls(monkeypatch, images, "copy_images")
    call("convert", scene, "/dev/null").product()
    assert not copied


@pytest.mark.parametrize("out", ["a.glb", "a.gltf", "a.npz"])
def test_links_that_lead_to_themselves_are_not_replaced(out: str, call: Call, walk: Path, tmp_path: Path) -> None:
    one, other = tmp_path / out, tmp_path / f"b{Path(out).suffix}"
    one.symlink_to(other)
    other.symlink_to(one)
    line = ["bake", walk, one] if out == "a.npz" else ["convert", walk, one]
    assert refusal(call(*line), 3) == f"gltf-anim: {one}: is a loop of links"
    assert one.is_symlink()
