"""`run`: buffers and images of inputs and outputs, for --resume and in the report."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.cli.running_recipes import journal, write_recipe

RESUME = ("run", "--resume", "--no-cache")


@pytest.fixture
def text_file(folder: Path, call: Call) -> Path:
    """A folder with crowd/arm.gltf, its buffer and its image, and the recipe."""
    call("convert", "crowd/arm 1.glb", "crowd/arm.gltf").product()
    path = folder / "crowd/arm.gltf"
    document = json.loads(path.read_text())
    path.write_text(json.dumps({**document, "images": [{"uri": "skin.png"}]}))
    (folder / "crowd/skin.png").write_bytes(b"\x89PNG")
    write_recipe(folder, "resample --fps 12", match="crowd/*.gltf", out="build/{stem}.gltf")
    return folder


def flip_end(path: Path) -> None:
    """Change the last byte of a file."""
    data = bytearray(path.read_bytes())
    data[-1] ^= 1
    path.write_bytes(data)


@pytest.mark.parametrize("name", ["crowd/arm.bin", "crowd/skin.png", "build/arm.bin", "build/skin.png"])
@pytest.mark.parametrize("change", [flip_end, Path.unlink])
def test_resume_makes_again_what_has_another_buffer_or_image(
    name: str, change: Callable[[Path], None], text_file: Path, call: Call
) -> None:
    call("run", "--no-cache").product()
    assert "1 file: 1 done before" in call(*RESUME).err
    output = text_file / name
    before = output.read_bytes()
    change(output)
    run = call(*RESUME)
    if (name, change) == ("crowd/arm.bin", Path.unlink):
        assert run.code == 3
        return
    assert "1 file: 1 made" in run.err
    if name == "build/arm.bin":
        (buffer,) = json.loads((text_file / "build/arm.gltf").read_text())["buffers"]
        assert (text_file / "build" / buffer["uri"]).read_bytes() == before
    if name.startswith("build"):
        assert before in [path.read_bytes() for path in (text_file / "build").iterdir()]
    assert "1 file: 1 done before" in call(*RESUME).err


def test_resume_after_a_run_from_the_cache_has_the_same_stamps(text_file: Path, call: Call) -> None:
    call("run").product()
    made = journal(text_file)
    assert set(made[0]["files"]) == {"crowd/arm.bin", "crowd/skin.png", "build/arm.bin", "build/skin.png"}
    assert "1 file: 1 cached" in call("run").err
    assert journal(text_file)[0]["files"] == made[0]["files"]
    flip_end(text_file / "crowd/arm.bin")
    assert "1 file: 1 made" in call("run", "--resume").err


def test_the_buffer_of_the_input_is_not_removed_with_the_old_output(text_file: Path, call: Call) -> None:
    """It belonged to the output that the run replaces, as its name says."""
    (text_file / "gltf-anim.toml").unlink()
    write_recipe(text_file, "resample --fps 12", match="arm.gltf", out="far/out/{name}")
    call("convert", "crowd/arm 1.glb", "arm.gltf").product()
    old = (text_file / "arm.gltf").read_text(), (text_file / "arm.bin").read_bytes()
    (text_file / "arm.bin").unlink()
    (text_file / "arm.gltf").write_text(old[0].replace("arm.bin", "far/out/arm.bin"))
    (text_file / "far/out").mkdir(parents=True)
    for status in ("made", "cached"):
        (text_file / "far/out/arm.gltf").write_text(old[0])
        (text_file / "far/out/arm.bin").write_bytes(old[1])
        assert f"1 file: 1 {status}" in call("run").err
        assert (text_file / "far/out/arm.bin").read_bytes() == old[1]


def test_images_that_a_step_embeds_count_for_the_cache(text_file: Path, call: Call) -> None:
    (text_file / "gltf-anim.toml").unlink()
    write_recipe(text_file, "convert --embed", match="crowd/*.gltf", out="build/{stem}.glb")
    call("run").product()
    before = (text_file / "build/arm.glb").read_bytes()
    (text_file / "crowd/skin.png").write_bytes(b"\x89PNG, other")
    assert "1 file: 1 made" in call("run").err
    assert (text_file / "build/arm.glb").read_bytes() != before


def test_the_sizes_of_a_gltf_are_those_of_the_single_command(text_file: Path, call: Call) -> None:
    sizes = r"[\d.]+ kB → [\d.]+ kB \([^)]*\)"
    (text_file / "single").mkdir()
    single = re.search(sizes, call("resample", "crowd/arm.gltf", "single/arm.gltf", "--fps", "12").err)
    assert single is not None
    for options in ((), ("-v",), ("-v", "--resume")):
        assert single[0] in call("run", *options).err.replace("build", "single"), options


def test_missing_images_are_noted_and_in_the_journal(text_file: Path, call: Call) -> None:
    (text_file / "crowd/skin.png").unlink()
    line = "note: 1 image missing, since no such file can be read (skin.png)"
    for _ in ("made", "cached"):
        assert f"crowd/arm.gltf: {line}" in call("run").err
        assert journal(text_file)[0]["messages"] == [line]
        (text_file / "build/arm.bin").unlink()
    assert "note" not in call("run", "-q").err


@pytest.mark.parametrize("ending", [".gltf", ".glb"])
@pytest.mark.parametrize("order", ["at once", "one after the other"])
def test_inputs_of_the_same_content_have_buffers_of_their_own(
    ending: str, order: str, text_file: Path, call: Call
) -> None:
    """The text of two exports of a rig may be the same, with motion in the .bin beside it."""
    (text_file / "gltf-anim.toml").unlink()
    write_recipe(text_file, "resample --fps 12", match="*/arm.gltf", out=f"build/{{folder}}/{{stem}}{ending}")
    shutil.copytree(text_file / "crowd", text_file / "other")
    flip_end(text_file / "other/arm.bin")
    made = [f"build/{folder}/arm{'.bin' if ending == '.gltf' else ending}" for folder in ("crowd", "other")]
    call("run", "--no-cache").product()
    expected = [(text_file / name).read_bytes() for name in made]
    assert expected[0] != expected[1]
    shutil.rmtree(text_file / "build")
    for folders in [()] if order == "at once" else [("crowd/arm.gltf",), ("other/arm.gltf",)]:
        call("run", *folders).product()
    assert [(text_file / name).read_bytes() for name in made] == expected
    shutil.rmtree(text_file / "build")
    assert "2 files: 2 cached" in call("run").err
    assert [(text_file / name).read_bytes() for name in made] == expected


@pytest.mark.parametrize("is_link", [False, True])
def test_a_buffer_of_the_input_at_the_place_of_the_output_is_not_replaced(
    is_link: bool, text_file: Path, call: Call
) -> None:
    """The input was lost."""
    (text_file / "gltf-anim.toml").unlink()
    write_recipe(text_file, "resample --fps 12", match="crowd/*.gltf", out="{folder}/{stem}.glb")
    buffer = text_file / f"crowd/arm.{'bin' if is_link else 'glb'}"
    if is_link:
        call("run").product()  # now from the cache
        (text_file / "crowd/arm.glb").unlink()
        (text_file / "crowd/arm.glb").symlink_to("arm.bin")
    else:
        (text_file / "crowd/arm.bin").rename(buffer)
        path = text_file / "crowd/arm.gltf"
        path.write_text(path.read_text().replace("arm.bin", "arm.glb"))
    before = buffer.read_bytes()
    run = call("run")
    assert run.code == 3
    assert "'crowd/arm.glb', the output of 'crowd/arm.gltf', is a file that its own steps read" in run.err
    assert buffer.read_bytes() == before
