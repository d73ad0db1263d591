"""`render`: pictures that others can open, of files, pipes and caches."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from anim.caches.registry import CACHE_FORMATS, Files
from tests.anim.caches.making import cache, written
from tests.cli.conftest import Call, Find, Fixture
from tests.cli.running import built, help_line, refusal
from tests.files import glb_of, opened_fixture

SMALL = ("--size", "64")


def opened(path: Path) -> Any:
    """The picture in a file, which is closed again."""
    return Image.open(io.BytesIO(path.read_bytes()))


def test_a_strip_of_a_file(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    run = call("render", fixture("biped"), tmp_path / "walk.png", "--clip", "walk", *SMALL)
    assert run.out == b""
    assert "walk.png  " in run.err
    assert "8 frames" in run.err
    image = opened(tmp_path / "walk.png")
    assert image.mode == "RGB"
    assert np.asarray(image).std() > 10


def test_pipes(call: Call) -> None:
    one = call("render", *SMALL, "--frames", "2", stdin=built("arm")).product()
    assert Image.open(io.BytesIO(one)).size[0] > 64
    data = written(cache(), "a.npz")[0].files["a.npz"]
    assert call("render", *SMALL, "--at", "0.1", stdin=data).product().startswith(b"\x89PNG")
    assert (
        call("render", *SMALL, "--at", "0.1", stdin=data).out == call("render", *SMALL, "--at", "0.1", stdin=data).out
    )


def test_methods_and_clips_are_rows(fixture: Fixture, call: Call) -> None:
    def height(*args: str) -> int:
        data = call("render", path, "-", "--frames", "2", *SMALL, *args).product()
        return int(Image.open(io.BytesIO(data)).size[1])

    path = fixture("arm")
    one = height("--clip", "twist")
    assert height("--method", "lbs", "--method", "dqs", "--clip", "twist", "--heat") > one + 60
    assert height("--clip", "*") > one + 60
    assert height() == one


@pytest.mark.parametrize(("ending", "form"), [(".webp", "WEBP"), (".gif", "GIF"), (".apng", "PNG")])
def test_moving_pictures(ending: str, form: str, fixture: Fixture, call: Call, tmp_path: Path) -> None:
    call("render", fixture("arm"), tmp_path / f"a{ending}", "--clip", "bend", "--fps", "5", *SMALL).product()
    image = opened(tmp_path / f"a{ending}")
    assert image.format == form
    assert image.n_frames == 6
    assert image.info.get("duration", 200) == 200


@pytest.mark.parametrize(("option", "frames", "each"), [("--fps", "5", 200), ("--frames", "9", 427)])
def test_clips_of_a_film_play_at_one_speed_until_the_longest_ends(
    option: str, frames: str, each: float, asset: Find, call: Call, tmp_path: Path
) -> None:
    """Fox: Survey takes 3.42 s, Walk 0.71 s, Run 1.16 s."""
    call("render", asset("Fox.glb"), tmp_path / "a.webp", "--clip", "*", option, frames, *SMALL).product()
    image = opened(tmp_path / "a.webp")
    assert image.n_frames == (9 if option == "--frames" else 19)  # the end too
    image.load()
    assert image.info["duration"] == pytest.approx(each, abs=1)


def test_a_row_shows_the_times_that_its_clip_has(asset: Find, call: Call, tmp_path: Path) -> None:
    def height(*args: object) -> int:
        call("render", asset("Fox.glb"), tmp_path / "a.png", *args, *SMALL).product()
        return int(opened(tmp_path / "a.png").size[1])

    assert height("--clip", "*", "--at", "0.9") == height("--clip", "Survey", "--clip", "Run", "--at", "0.9")
    assert height("--clip", "*", "--at", "0.5") > height("--clip", "*", "--at", "0.9")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a.npz", "a.mdd", "a.ply", "a.usdc", "a.exr", "a.glb"])
def test_caches(name: str, call: Call, tmp_path: Path) -> None:
    for file, data in written(cache(), name)[0].files.items():
        (tmp_path / file).write_bytes(data)
    call("render", tmp_path / name, tmp_path / "out.png", "--frames", "2", *SMALL).product()
    assert opened(tmp_path / "out.png").size[0] > 100


@pytest.mark.parametrize(
    "name",
    ["CesiumMan.glb", "Fox.glb", "Robot.glb", "MorphStressTest.glb", "BusterDrone/busterDrone.gltf", "vrm/test.vrma"],
)
def test_real_files(name: str, asset: Find, call: Call) -> None:
    data = call("render", asset(name), "-", "--frames", "2", *SMALL).product()
    assert np.asarray(Image.open(io.BytesIO(data))).std() > 8


@pytest.mark.parametrize("name", ["interpolations", "morph_cube", "pointer", "noop", "accessors", "gltf_embedded"])
def test_every_fixture(name: str, fixture: Fixture, call: Call) -> None:
    call("render", fixture(name), "-", "--frames", "2", *SMALL).product()


@pytest.mark.parametrize(
    ("args", "code", "words"),
    [
        (["a.jpg"], 2, "unsupported image format '.jpg'"),
        (["a.png", "--clip", "no"], 5, "no clip matches 'no'"),
        (["a.png", "--method", "foo"], 2, "'foo' is none of lbs, dqs, cor"),
        (["a.png", "--at", "1", "--frames", "2"], 2, "--at excludes"),
        (["a.png", "--from", "7"], 2, "nothing lies"),
        (["a.png", "--at", "0.5", "--at", "7"], 2, "there is no frame at 7 s (the motion goes from 0 s to "),
        (["a.png", "--size", "3"], 2, "too small"),
    ],
)
def test_what_can_t_be_done(
    args: list[str], code: int, words: str, fixture: Fixture, call: Call, tmp_path: Path
) -> None:
    assert words in refusal(call("render", fixture("arm"), tmp_path / args[0], *args[1:]), code)
    assert not (tmp_path / args[0]).exists()


def test_a_cache_has_no_clips(call: Call, tmp_path: Path) -> None:
    (tmp_path / "a.npz").write_bytes(written(cache(), "a.npz")[0].files["a.npz"])
    line = refusal(call("render", tmp_path / "a.npz", tmp_path / "a.png", "--method", "dqs"), 2)
    assert "does not apply to a vertex cache" in line


@pytest.mark.parametrize("data", [b"", b"hello", b"glTF"])
def test_bad_input(data: bytes, call: Call) -> None:
    refusal(call("render", stdin=data), 3)


def test_a_film_says_how_many_frames_it_has(fixture: Fixture, call: Call, tmp_path: Path) -> None:
    """Walking is a loop of 1 s: the frame at its end is the one at its start."""
    run = call("render", fixture("biped"), tmp_path / "a.webp", "--clip", "walk", "--fps", "10", *SMALL)
    assert opened(tmp_path / "a.webp").n_frames == 10
    assert ", 10 frames, " in run.err


def test_one_frame_is_one_for_several_clips_too(asset: Find, call: Call, tmp_path: Path) -> None:
    call("render", asset("Fox.glb"), tmp_path / "a.webp", "--clip", "*", "--frames", "1", *SMALL).product()
    assert opened(tmp_path / "a.webp").n_frames == 1


def test_a_time_between_all_clips_is_refused(call: Call, tmp_path: Path) -> None:
    trimmed = call("trim", "-", "--clip", "bend", "--from", "0.6", stdin=built("arm")).product()
    trimmed = call("trim", "-", "--clip", "twist", "--to", "0.4", stdin=trimmed).product()
    line = refusal(call("render", "-", tmp_path / "a.png", "--clip", "*", "--at", "0.5", *SMALL, stdin=trimmed), 2)
    assert "no clip has a frame at 0.5 s" in line


def test_one_frame_of_any_format_comes_through_a_pipe(call: Call) -> None:
    for ending in (ending for ending, each in CACHE_FORMATS.items() if each.files is Files.FRAMES):
        data = call("convert-cache", "-", "-", "--at", "0", "--format", ending[1:], stdin=_npz()).product()
        assert call("render", *SMALL, stdin=data).product().startswith(b"\x89PNG")
    line = refusal(call("render", *SMALL, stdin=b"\x76\x2f\x31\x01" + bytes(100)), 2)
    assert "several files" in line


def test_what_a_reader_says_is_said(call: Call, tmp_path: Path) -> None:
    for file, data in written(cache(), "a.pc2")[0].files.items():
        (tmp_path / file).write_bytes(data)
    rest = (tmp_path / "a.pc2-rest.ply").read_bytes()
    (tmp_path / "a.pc2-rest.ply").unlink()
    (tmp_path / "a-rest.ply").write_bytes(rest.replace(b" of=", b" by="))  # as earlier versions wrote it
    run = call("render", tmp_path / "a.pc2", tmp_path / "a.png", *SMALL)
    assert "warning: faces and axes are those of 'a-rest.ply'" in run.err


def _npz() -> bytes:
    return written(cache(), "a.npz")[0].files["a.npz"]


@pytest.mark.slow
def test_meshes_are_chosen_and_hidden(asset: Find, call: Call) -> None:
    def drawn(*args: str) -> bytes:
        run = call("render", asset("Knight.glb"), "-", "--clip", "Idle", "--frames", "1", *SMALL, *args)
        return bytes(run.product())

    shields = ("--hide", "*Shield*")
    assert drawn() != drawn(*shields)
    legs = drawn("--mesh", "Knight_Leg*")
    assert legs == drawn("--mesh", "Knight_*", "--hide", "*Arm*", "--hide", "*_[BHC]*")
    assert drawn("--hide", "handslot*") == drawn("--hide", "1H_*", "--hide", "2H_*", *shields)


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["--hide", "Rectangel*"], "no mesh or node matches 'Rectangel*'"),
        (["--mesh", "nobody"], "no mesh matches 'nobody'"),
        (["--hide", "*"], "no mesh is left to draw"),
    ],
)
def test_what_nothing_is_left_of(args: list[str], words: str, fixture: Fixture, call: Call, tmp_path: Path) -> None:
    assert words in refusal(call("render", fixture("arm"), tmp_path / "a.png", *args), 5)


def test_materials_are_shown_unless_surfaces_are(asset: Find, call: Call) -> None:
    def drawn(*options: str) -> bytes:
        return bytes(call("render", asset("Fox.glb"), "-", "--frames", "1", *SMALL, *options).product())

    def is_orange(picture: bytes) -> bool:
        pixels = np.asarray(Image.open(io.BytesIO(picture))).astype(int)
        return bool(((pixels[..., 0] > 180) & (pixels[..., 2] < 60)).sum() > 20)

    assert is_orange(drawn())
    assert drawn() == drawn("--textures")
    assert not is_orange(drawn("--no-textures"))
    for look in ("--checker", "--wire", "--heat"):
        assert drawn(look) == drawn(look, "--no-textures")
    assert drawn("--checker") != drawn("--checker", "--textures")


def test_textures_lie_beside_the_file_and_never_elsewhere(asset: Find, call: Call, tmp_path: Path) -> None:
    path = asset("CesiumMan-gltf/CesiumMan.gltf")
    one = ("-", "--frames", "1", *SMALL)
    run = call("render", path, *one)
    assert "note" not in run.err
    assert run.product() != call("render", path, *one, "--no-textures").product()
    piped = call("render", *one, stdin=call("convert", path, "-").product())
    assert "note: stdin: image 0: 'CesiumMan_img0.jpg' lies beside the file, but the input is a pipe" in piped.err
    assert "note" not in call("render", *one, stdin=call("convert", path, "-", "--embed").product()).err
    (tmp_path / "in").mkdir()
    (image,) = path.parent.glob("*.jpg")
    (tmp_path / "up.jpg").write_bytes(image.read_bytes())
    for each in (*path.parent.glob("*.bin"), path):
        (tmp_path / "in" / each.name).write_bytes(each.read_bytes().replace(image.name.encode(), b"../up.jpg"))
    run = call("render", tmp_path / "in" / path.name, *one)
    assert "image 0: URI '../up.jpg' leaves the file's folder" in run.err
    assert run.err.count("note: ") == 1
    assert run.product()


@pytest.mark.parametrize("option", ["--checker", "--wire", "--follow", "--heat"])
def test_what_is_drawn_on_the_surface(option: str, fixture: Fixture, call: Call) -> None:
    args = ("render", fixture("tube"), "-", "--clip", "twist180", "--frames", "3", *SMALL)
    plain, marked = call(*args).product(), call(*args, option).product()
    assert plain != marked
    assert call(*args, option).product() == marked


def test_a_gltf_with_a_buffer_beside_it_needs_its_path(call: Call) -> None:
    run = call("render", "-", "-", stdin=built("gltf_external"))
    assert "'walk data.bin' lies beside the file, but the input is a pipe" in refusal(run, 3)
    assert help_line(run) == "give the file's path, or pipe a GLB"


@pytest.mark.parametrize(
    ("extensions", "azimuth"), [(("VRM",), "215"), (("VRMC_vrm",), "35"), (("VRM", "VRMC_vrm"), "35")]
)
def test_figures_of_vrm_0_are_drawn_from_their_front(extensions: tuple[str, ...], azimuth: str, call: Call) -> None:
    document = opened_fixture("arm")
    named = {"extensions": {name: {} for name in extensions}, "extensionsUsed": list(extensions)}
    turned = glb_of(replace(document, json={**document.json, **named}))
    options = ("-", "-", "--frames", "1", "--size", "64")
    expected = call("render", *options, "--azimuth", azimuth, stdin=built("arm")).product()
    assert call("render", *options, stdin=turned).product() == expected
