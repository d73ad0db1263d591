"""Images that a run copied beside outputs which it deletes later."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.cli.running import built
from tests.cli.running_recipes import PLAIN, built_files, run_with_a_deleted_input, write_crowd, write_recipe


@pytest.fixture
def made(folder: Path, call: Call) -> Path:
    return run_with_a_deleted_input(folder, call)


@pytest.fixture
def pictured(made: Path, call: Call) -> Path:
    """A folder with a run of two .gltf files with images, one of them shared; the input of the first is deleted."""
    for path in (made / "crowd").iterdir():
        path.unlink()
    (made / "crowd/skins").mkdir()
    for name in ("shared", "own"):
        (made / f"crowd/skins/{name}.png").write_bytes(b"\x89PNG" + name.encode())
    for name, images in {"a": ("own", "shared"), "b": ("shared",)}.items():
        call("convert", "-", made / f"crowd/{name}.gltf", stdin=built("arm")).product()
        document = json.loads((made / f"crowd/{name}.gltf").read_text())
        document["images"] = [{"uri": f"skins/{image}.png"} for image in images]
        (made / f"crowd/{name}.gltf").write_text(json.dumps(document))
    (made / "gltf-anim.toml").unlink()
    write_recipe(made, *PLAIN, match="crowd/*.gltf", out="build/{stem}.gltf")
    call("run", "--delete-stale").product()
    (made / "crowd/a.gltf").unlink()
    assert built_files(made) >= {"build/a.gltf", "build/skins/own.png", "build/skins/shared.png"}
    return made


KEPT = {"build/b.gltf", "build/b.bin"}
SHARED, OWN = "build/skins/shared.png", "build/skins/own.png"


def test_images_that_a_run_copied_are_deleted_with_their_built_files(pictured: Path, call: Call) -> None:
    assert "(build/a.gltf): deleted, with 1 image\n" in call("run", "--delete-stale").err
    assert built_files(pictured) == {*KEPT, SHARED}
    (pictured / "crowd/b.gltf").unlink()
    assert call("run", "--delete-stale").code == 3
    assert not (pictured / "build").exists()


def test_images_of_a_run_that_was_ended_are_deleted_too(pictured: Path, call: Call) -> None:
    """The journal has them."""
    shutil.rmtree(pictured / "build")
    call("run", "--no-cache").product()
    record = pictured / ".gltf-anim-cache/outputs.json"
    write_crowd(pictured, a="arm")
    (pictured / "crowd/a.glb").rename(pictured / "crowd/a")
    (pictured / "crowd/b.gltf").unlink()
    record.unlink()
    call("run", "--delete-stale")
    assert not (pictured / "build/b.gltf").exists()
    assert not (pictured / SHARED).exists()


def change_image(made: Path) -> None:
    (made / OWN).write_bytes(b"\x89PNG, other")


def replace_image_before(made: Path) -> None:
    """The image was there, with the same content, before the run."""
    record = made / ".gltf-anim-cache/outputs.json"
    content = json.loads(record.read_text())
    del content["copies"][str(made)][OWN]
    record.write_text(json.dumps(content))
    (made / ".gltf-anim-cache/journal.jsonl").unlink()


def name_in_other(made: Path) -> None:
    (made / "build/mine.gltf").write_text('{"asset": {"version": "2.0"}, "images": [{"uri": "skins/own.png"}]}')


def name_below(made: Path) -> None:
    """Another output names it from a folder beside it."""
    text = (made / "build/b.gltf").read_text()
    (made / "crowd/b.gltf").write_text(text.replace("skins/shared.png", "../build/skins/own.png"))
    shutil.copy(made / "build/b.bin", made / "crowd/b.bin")


def name_from_beside(made: Path) -> None:
    """A glTF in another folder of the settings, which no run knows, names it."""
    (made / "levels").mkdir()
    text = '{"asset": {"version": "2.0"}, "images": [{"uri": "../build/skins/own.png"}]}'
    (made / "levels/level.gltf").write_text(text)


def link_to_it(made: Path) -> None:
    (made / "build/link.png").symlink_to("skins/own.png")


def name_as_input(made: Path) -> None:
    """As a file that a recipe reads, from far above."""
    (made / "far").mkdir()
    shutil.move(made / "build", made / "far/build")
    text = (made / "far/build/a.gltf").read_text()
    (made / "top.gltf").write_text(text.replace("skins/", "far/build/skins/").replace("a.bin", "far/build/a.bin"))
    record = made / ".gltf-anim-cache/outputs.json"
    record.write_text(record.read_text().replace('"build/', '"far/build/'))
    (made / "gltf-anim.toml").write_text((made / "gltf-anim.toml").read_text().replace('"build/', '"far/build/'))
    write_recipe(made, *PLAIN, match="top.gltf", out="small/{path}")


def break_other(made: Path) -> None:
    """A glTF that can't be read may name it."""
    (made / "build/broken.gltf").write_text("{")


@pytest.mark.parametrize(
    "change",
    [
        change_image,
        replace_image_before,
        name_in_other,
        name_below,
        name_from_beside,
        link_to_it,
        name_as_input,
        break_other,
    ],
)
def test_images_that_others_may_need_are_not_deleted(
    change: Callable[[Path], None], pictured: Path, call: Call
) -> None:
    change(pictured)
    run = call("run", "--delete-stale")
    assert "build/a.gltf): deleted" in run.err
    place = pictured / ("far/build" if change is name_as_input else "build")
    assert (place / "skins/own.png").exists()
    assert not (place / "a.gltf").exists()
