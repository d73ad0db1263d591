"""`run`: outputs that a link leads to an input or out of the folder, and inputs that are no regular files."""

from __future__ import annotations

import errno
import json
import os
import sys
from pathlib import Path

import pytest

from anim.errors import OutputError
from anim.gltf.io.source import open_file
from cli.workflows.run.job import Job
from cli.workflows.run.places import check_output
from tests.cli.conftest import Call
from tests.cli.running import built, refusal
from tests.cli.running_recipes import write_crowd, write_recipe

PLAIN = "resample --fps 12"

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no named pipes, and links need a right")


@pytest.mark.parametrize(
    ("link", "target", "words"),
    [
        ("build", ".", "is its own output"),
        ("build", "..", "leads out of the folder of the settings"),
        ("build/crowd/hero.glb", "../../crowd/hero.glb", "is its own output"),
        ("build/crowd/hero.glb", "../../crowd/cube.glb", "is the input 'crowd/cube.glb'"),
        ("build/crowd/hero.glb", "../../../outside.glb", "leads out of the folder of the settings"),
        ("build/crowd/hero.glb", "cube.glb", "are the same output"),
        ("build/crowd/hero.glb", "../../fifo", "is no regular file"),
    ],
)
def test_no_link_leads_an_output_elsewhere(link: str, target: str, words: str, tmp_path: Path, call: Call) -> None:
    """It replaced the input, or a file outside, with exit 0."""
    folder = tmp_path / "project"
    folder.mkdir()
    write_crowd(folder, hero="biped", cube="morph_cube")
    write_recipe(folder, PLAIN)
    os.mkfifo(folder / "fifo")
    (folder / link).parent.mkdir(parents=True, exist_ok=True)
    (folder / link).symlink_to(target)
    assert words in refusal(call("run", "--config", folder / "gltf-anim.toml"), 2)
    assert (folder / "crowd/hero.glb").read_bytes() == built("biped")
    assert (folder / "crowd/cube.glb").read_bytes() == built("morph_cube")
    assert {each.name for each in tmp_path.iterdir()} == {"project"}


def test_an_output_is_no_file_that_its_own_steps_read(folder: Path, call: Call) -> None:
    write_recipe(folder, "from-euler --onto build/take.glb", match="*.bvh", out="build/{stem}.glb")
    (folder / "take.bvh").write_text("HIERARCHY")
    assert "is a file that its own steps read" in refusal(call("run"), 2)


def test_a_link_made_during_the_run_is_found_before_writing(folder: Path) -> None:
    job = Job(folder, "crowd/arm 1.glb", "build/crowd/arm 1.glb", ())
    check_output(job)
    (folder / "build").symlink_to(".")
    with pytest.raises(OutputError, match="its own output"):
        check_output(job)


def test_copies_of_images_stay_in_the_folder(
    folder: Path, call: Call, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """They were written outside, through a link beside the output."""
    outside = tmp_path_factory.mktemp("outside")
    call("convert", "crowd/arm 1.glb", "crowd/arm.gltf").product()
    path = folder / "crowd/arm.gltf"
    path.write_text(json.dumps({**json.loads(path.read_text()), "images": [{"uri": "tex/skin.png"}]}))
    for name in ("crowd/tex", "build", "within"):
        (folder / name).mkdir()
    (folder / "crowd/tex/skin.png").write_bytes(b"\x89PNG")
    write_recipe(folder, PLAIN, match="crowd/*.gltf", out="build/{name}")
    (folder / "build/tex").symlink_to(outside)
    run = call("run")
    assert run.code == 3
    assert f"build/tex/skin.png: leads out of '{folder}' by a link" in run.err
    assert list(outside.iterdir()) == []
    assert not (folder / "build/arm.gltf").exists()
    (outside / "skin.png").write_bytes(b"\x89PNG")  # then nothing is written there
    assert "1 file: 1 cached" in call("run").err
    (folder / "build/tex").unlink()
    (folder / "build/tex").symlink_to("../within")
    assert "1 file: 1 cached" in call("run").err
    assert (folder / "within/skin.png").exists()


def fail(*args: object, **options: object) -> Path:
    """Fail as the system does for what was a link a moment before."""
    raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))


def test_a_folder_that_is_exchanged_with_a_link_is_one_line(
    folder: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was a traceback."""
    write_recipe(folder, PLAIN)
    monkeypatch.setattr("cli.workflows.run.job.check_output", fail)
    run = call("run", "--no-cache")
    assert run.code == 3
    assert "gltf-anim: build/crowd/arm 1.glb: can't be written (" in run.err


def test_a_folder_that_can_not_be_looked_up_is_an_error_of_the_output(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = open_file(str(folder / "noop.glb"))
    monkeypatch.setattr(Path, "resolve", fail)
    with pytest.raises(OutputError, match=r"noop\.glb: can't be written"):
        source.is_in_folder("build/noop.glb")


@pytest.mark.parametrize(
    ("first", "second"), [("x/Hero.glb", "y/hero.glb"), ("x/\u00e4.glb", "y/a\u0308.glb"), ("x/Ä.glb", "y/a\u0308.glb")]
)
def test_names_that_are_one_on_some_file_systems_are_refused(first: str, second: str, folder: Path, call: Call) -> None:
    """There one output replaced the other."""
    for name in (first, second):
        (folder / name).parent.mkdir()
        (folder / name).write_bytes(built("arm"))
    write_recipe(folder, PLAIN, match="[xy]/*.glb", out="build/{name}")
    words = "the same output on file systems that ignore case"
    assert words in refusal(call("run"), 2)
    assert words in refusal(call("resample", first, second, "--fps", "12", "-o", "build/{name}"), 2)
    assert not (folder / "build").exists()


def test_an_input_is_no_output_in_other_case(folder: Path, call: Call) -> None:
    """It was replaced where case does not count."""
    (folder / "crowd/arm 1.glb").rename(folder / "crowd/Arm.glb")
    write_recipe(folder, PLAIN, out="crowd/arm.glb")
    assert "'crowd/Arm.glb' is its own output" in refusal(call("run"), 2)
    (folder / "crowd/arm.bvh").write_text("HIERARCHY")
    (folder / "gltf-anim.toml").unlink()
    write_recipe(folder, "from-euler", match="crowd/*.bvh", out="crowd/arm.glb")
    write_recipe(folder, PLAIN)
    assert "the output of 'crowd/arm.bvh', is the input 'crowd/Arm.glb'" in refusal(call("run"), 2)


def test_links_within_the_folder_remain(folder: Path, call: Call) -> None:
    write_crowd(folder, hero="biped")
    write_recipe(folder, PLAIN)
    (folder / "made").mkdir()
    (folder / "build").symlink_to("made")
    for words in ("2 made", "2 cached"):
        assert words in call("run").err
    assert (folder / "made/crowd/hero.glb").is_file()


def test_pipes_among_the_inputs_are_left_out(folder: Path, call: Call) -> None:
    """A run waited for a writer of the pipe."""
    os.mkfifo(folder / "crowd/fifo.glb")
    write_recipe(folder, PLAIN)
    assert "1 file: 1 made" in call("run").err
    assert "crowd/fifo.glb: is no regular file" in refusal(call("run", "crowd/fifo.glb"), 3)


def test_files_of_steps_are_regular(folder: Path, call: Call) -> None:
    os.mkfifo(folder / "tail.json")
    write_recipe(folder, "simulate springs --chain '*' --springs tail.json")
    assert "tail.json: is no regular file" in refusal(call("run"), 3)
