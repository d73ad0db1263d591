"""`convert`: images beside the file stay, go along or are embedded."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path

import pytest

from tests.cli.conftest import Call, Fixture
from tests.cli.running import built, refusal
from tests.cli.running_recipes import write_recipe
from tests.fixtures.reading import split

PNG = b"\x89PNG\r\n\x1a\n" + bytes(20)
JPEG = b"\xff\xd8\xff\xe0" + bytes(20)


def with_images(folder: Path) -> Path:
    """A file with one image beside it, one below it, and one inside it."""
    (folder / "textures").mkdir(parents=True)
    (folder / "skin.png").write_bytes(PNG)
    (folder / "textures" / "a b.jpg").write_bytes(JPEG)
    images = [{"uri": "skin.png", "name": "skin"}, {"uri": "textures/a%20b.jpg"}, {"uri": "data:image/png;base64,AAAA"}]
    (folder / "scene.gltf").write_text(json.dumps({"asset": {"version": "2.0"}, "images": images}))
    return folder / "scene.gltf"


def test_images_stay_beside_and_that_is_said(call: Call, tmp_path: Path) -> None:
    path = with_images(tmp_path / "in")
    inside = call("convert", path, tmp_path / "in" / "scene.glb")
    assert "note" not in inside.err
    assert [image["uri"][:9] for image in split((tmp_path / "in" / "scene.glb").read_bytes())[0]["images"]] == [
        "skin.png",
        "textures/",
        "data:imag",
    ]


@pytest.mark.parametrize("line", [["convert"], ["resample", "--fps=9"], ["optimize", "--effort=fast"]])
def test_images_that_a_pipe_leaves_behind_are_a_warning(line: list[str], call: Call, tmp_path: Path) -> None:
    """They were a note of `convert`, and nothing of other commands."""
    path = with_images(tmp_path)
    words = "warning: 2 images left behind (skin.png, textures/a%20b.jpg): a pipe carries one GLB; "
    said = call(line[0], path, "-", *line[1:], "-q").err
    assert said.count(words) == 1
    whole = call("convert", path, "-", "--embed").product()
    assert "warning" not in call(line[0], "-", "-", *line[1:], stdin=whole).err
    assert "warning" not in call(line[0], path, tmp_path / "out.glb", *line[1:]).err


def test_steps_of_recipes_leave_no_image_behind(call: Call, folder: Path) -> None:
    with_images(folder / "in")
    write_recipe(folder, "resample --fps 9", "convert", match="in/*.gltf", out="build/{stem}.glb")
    run = call("run")
    run.product()
    assert "warning" not in run.err
    assert (folder / "build/skin.png").read_bytes() == PNG


@pytest.mark.parametrize("out", ["scene.glb", "scene.gltf"])
@pytest.mark.parametrize("line", [["convert"], ["resample", "--fps=9"]])
def test_images_go_along_to_another_folder(out: str, line: list[str], call: Call, tmp_path: Path) -> None:
    path = with_images(tmp_path / "in")
    (tmp_path / "out").mkdir()
    run = call(line[0], path, tmp_path / "out" / out, *line[1:])
    run.product()
    assert "note: 2 images copied beside the output (skin.png, textures/a%20b.jpg)\n" in run.err
    assert (tmp_path / "out" / "skin.png").read_bytes() == PNG
    assert (tmp_path / "out" / "textures" / "a b.jpg").read_bytes() == JPEG
    before = (tmp_path / "out" / "skin.png").stat()
    again = call(line[0], path, tmp_path / "out" / out, *line[1:])
    again.product()
    assert (tmp_path / "out" / "skin.png").stat() == before
    assert "copied" not in again.err
    (tmp_path / "out/textures/a b.jpg").unlink()
    some = call(line[0], path, tmp_path / "out" / out, *line[1:])
    assert "note: 1 image copied beside the output (textures/a%20b.jpg)\n" in some.err


def test_an_image_of_another_file_is_not_overwritten(call: Call, tmp_path: Path) -> None:
    path = with_images(tmp_path / "in")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "skin.png").write_bytes(b"another")
    run = call("convert", path, tmp_path / "out" / "scene.gltf")
    run.product()
    assert (tmp_path / "out" / "skin.png").read_bytes() == b"another"
    written = json.loads((tmp_path / "out" / "scene.gltf").read_text())["images"]
    assert re.fullmatch(r"skin-[0-9a-f]{8}\.png", written[0]["uri"])
    assert (tmp_path / "out" / written[0]["uri"]).read_bytes() == PNG
    assert f"note: 2 images copied beside the output ({written[0]['uri']}, textures/a%20b.jpg)\n" in run.err
    assert written[1]["uri"] == "textures/a%20b.jpg"


def test_a_dry_run_copies_no_image(call: Call, tmp_path: Path) -> None:
    path = with_images(tmp_path / "in")
    (tmp_path / "out").mkdir()
    call("convert", path, tmp_path / "out" / "scene.gltf", "-n").product()
    assert list((tmp_path / "out").iterdir()) == []


def test_embed_takes_images_in(call: Call, tmp_path: Path) -> None:
    run = call("convert", with_images(tmp_path), "--embed")
    images = split(run.product())[0]["images"]
    assert "note" not in run.err
    assert images[0] == {"uri": "data:image/png;base64," + base64.b64encode(PNG).decode(), "name": "skin"}
    assert images[1] == {"uri": "data:image/jpeg;base64," + base64.b64encode(JPEG).decode()}
    assert images[2] == {"uri": "data:image/png;base64,AAAA"}


def test_embed_makes_a_gltf_of_one_file(call: Call, fixture: Fixture, tmp_path: Path) -> None:
    """The same bytes as a GLB, whether the buffer was in a GLB, beside a .gltf or embedded."""
    (tmp_path / "out").mkdir()
    for name in ("arm", "gltf_external", "gltf_embedded"):
        path = fixture(name)
        whole = call("convert", path, "-").product()
        call("convert", path, tmp_path / "out/scene.gltf", "--embed").product()
        assert [each.name for each in (tmp_path / "out").iterdir()] == ["scene.gltf"]
        (buffer,) = json.loads((tmp_path / "out/scene.gltf").read_text())["buffers"]
        assert buffer["uri"].startswith("data:application/octet-stream;base64,")
        assert call("convert", tmp_path / "out/scene.gltf", "-").product() == whole


def test_embed_in_place_removes_the_buffer(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "arm.gltf"
    call("convert", "-", path, stdin=built("arm")).product()
    assert (tmp_path / "arm.bin").exists()
    call("convert", path, path, "--embed").product()
    assert [each.name for each in tmp_path.iterdir()] == ["arm.gltf"]


def test_embed_does_what_it_can_and_says_what_is_missing(call: Call, tmp_path: Path) -> None:
    path = with_images(tmp_path)
    (tmp_path / "skin.png").unlink()
    run = call("convert", path, "--embed")
    images = split(run.product())[0]["images"]
    assert [image["uri"][:8] for image in images] == ["skin.png", "data:ima", "data:ima"]
    assert "note: 1 image missing, since no such file can be read (skin.png)\n" in run.err
    piped = call("convert", "--embed", stdin=path.read_bytes())
    assert split(piped.product())[0]["images"][0]["uri"] == "skin.png"
    assert "note: 2 images missing" in piped.err


def test_images_outside_the_folder_are_not_called_missing(call: Call, tmp_path: Path) -> None:
    path = with_images(tmp_path / "in")
    scene = json.loads(path.read_text())
    scene["images"][0]["uri"], scene["images"][1]["uri"] = "../skin.png", "https://example.org/skin.jpg"
    path.write_text(json.dumps(scene))
    (tmp_path / "skin.png").write_bytes(PNG)
    (tmp_path / "out").mkdir()
    run = call("convert", path, tmp_path / "out" / "scene.gltf")
    assert run.code == 0
    assert "note: 2 images refer out of the file's folder" in run.err
    assert "(../skin.png, https://example.org/skin.jpg)" in run.err
    assert "no such file" not in run.err


@pytest.mark.parametrize("link", ["buffer", "image"])
def test_links_that_lead_out_of_the_folder_are_not_followed(link: str, call: Call, tmp_path: Path) -> None:
    secret, folder = tmp_path / "secret", tmp_path / "in"
    secret.write_bytes(b"four")
    folder.mkdir()
    (folder / "file").symlink_to(secret)
    part = {"buffers": [{"byteLength": 4, "uri": "file"}]} if link == "buffer" else {"images": [{"uri": "file"}]}
    (folder / "scene.gltf").write_text(json.dumps({"asset": {"version": "2.0"}, **part}))
    run = call("convert", folder / "scene.gltf", "--embed")
    if link == "buffer":
        assert "'file' leads out of the file's folder" in refusal(run, 3)
        return
    assert split(run.product())[0]["images"] == [{"uri": "file"}]
    (tmp_path / "out").mkdir()
    call("convert", folder / "scene.gltf", tmp_path / "out" / "scene.gltf").product()
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["scene.gltf"]
