"""`run`: images come from the folder of the glTF that the steps begin with, as in single commands."""

from __future__ import annotations

import json
import shutil
from base64 import b64encode
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.cli.running import refusal
from tests.cli.running_recipes import write_recipe

OWN, FOREIGN = b"\x89PNG own", b"\x89PNG foreign"


@pytest.fixture
def hero(folder: Path, call: Call) -> Path:
    """A folder with lib/hero.gltf and its image, and another image of that name in crowd/."""
    (folder / "lib").mkdir()
    call("convert", "crowd/arm 1.glb", "lib/hero.gltf").product()
    path = folder / "lib/hero.gltf"
    path.write_text(json.dumps({**json.loads(path.read_text()), "images": [{"uri": "skin.png"}]}))
    (folder / "lib/skin.png").write_bytes(OWN)
    (folder / "crowd/skin.png").write_bytes(FOREIGN)
    return folder


def check_image(folder: Path, command: tuple[str, ...], call: Call) -> None:
    """Compare the image beside build/hero.glb, made and from the cache, with that of a single command."""
    (folder / "one").mkdir()
    call(*command, "one/hero.glb").product()
    assert (folder / "one/skin.png").read_bytes() == OWN
    for status in ("made", "cached"):
        assert f"1 file: 1 {status}" in call("run").err
        assert (folder / "build/skin.png").read_bytes() == OWN
        shutil.rmtree(folder / "build")


def test_an_input_behind_a_link_has_the_images_of_its_real_folder(hero: Path, call: Call) -> None:
    """It got those of the link's folder."""
    (hero / "crowd/hero.gltf").symlink_to("../lib/hero.gltf")
    write_recipe(hero, "convert", match="crowd/*.gltf", out="build/{stem}.glb")
    check_image(hero, ("convert", "crowd/hero.gltf"), call)


def test_a_character_has_the_images_of_its_own_folder(hero: Path, call: Call) -> None:
    """It got those beside the motion."""
    (hero / "crowd/hero.bvh").write_bytes(call("to-euler", "crowd/arm 1.glb", "-", "--clip", "#0").product())
    write_recipe(hero, "from-euler --onto lib/hero.gltf", match="crowd/*.bvh", out="build/{stem}.glb")
    check_image(hero, ("from-euler", "--onto", "lib/hero.gltf", "crowd/hero.bvh"), call)


def test_a_script_knows_the_files_of_a_character(hero: Path, call: Call) -> None:
    (hero / "crowd/hero.bvh").write_bytes(call("to-euler", "crowd/arm 1.glb", "-", "--clip", "#0").product())
    write_recipe(hero, "from-euler --onto lib/hero.gltf", match="crowd/*.bvh", out="build/{stem}.glb")
    rule = "build/hero.glb: crowd/hero.bvh lib/hero.gltf lib/hero.bin\n"
    assert rule in call("run", "--emit", "make").text
    (hero / "gltf-anim.toml").unlink()
    write_recipe(hero, "from-euler --onto lib/hero.gltf", "optimize", match="crowd/*.bvh", out="build/{stem}.glb")
    assert "lib/hero.gltf: its image 'skin.png' is another file" in refusal(call("run", "--emit", "make"), 2)


def test_a_later_step_takes_images_in(hero: Path, call: Call) -> None:
    """They were missing for it, since its input is no file; a change of one makes another result."""
    write_recipe(hero, "retime --speed 2", "convert --embed", match="lib/*.gltf", out="build/{stem}.glb")
    for data in (OWN, FOREIGN):
        (hero / "lib/skin.png").write_bytes(data)
        run = call("run")
        assert "1 file: 1 made" in run.err
        assert "note" not in run.err
        assert b64encode(data) in (hero / "build/hero.glb").read_bytes()
        assert not (hero / "build/skin.png").exists()
