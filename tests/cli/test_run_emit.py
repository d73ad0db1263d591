"""`run --emit`: scripts of single commands write the same bytes; `run --check`."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.cli.running import ENVIRONMENT, built, help_line, refusal
from tests.cli.running_recipes import write_crowd, write_recipe

TOOLS = {"shell": ["bash", "-e"], "make": ["make", "-j2", "-f"], "ninja": ["ninja", "-f"]}


def outputs(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes() for path in (folder / "build").rglob("*") if path.is_file()
    }


@pytest.mark.slow
@pytest.mark.parametrize("tool", TOOLS)
def test_a_script_makes_what_a_run_makes(tool: str, folder: Path, call: Call) -> None:
    if shutil.which(TOOLS[tool][0]) is None:
        pytest.skip(f"{TOOLS[tool][0]} is not installed")
    write_crowd(folder, **{"hero": "biped", "$home": "morph_cube", '#1: it\'s ("x")': "arm"})
    call("convert", "crowd/hero.glb", "crowd/text.gltf").product()
    write_recipe(folder, "resample --fps 12", "trim --to 0.5 --clip '*'")
    write_recipe(folder, "resample --fps 12", match="crowd/*.gltf", out="build/{stem}.gltf")
    (folder / "embedded.gltf").write_bytes(built("gltf_embedded"))
    write_recipe(folder, "resample --fps 12", match="*.gltf", out="build/{stem}.gltf")
    write_recipe(folder, "resample --fps 12", "convert --embed", match="*.glb", out="build/{stem}.gltf")
    call("run", "-q").product()
    made = outputs(folder)
    assert {"build/crowd/hero.glb", "build/crowd/$home.glb", "build/text.gltf"} < made.keys()
    shutil.rmtree(folder / "build")
    (folder / "script").write_bytes(call("run", "--emit", tool).product())
    subprocess.run([*TOOLS[tool], "script"], cwd=folder, env=ENVIRONMENT, check=True, capture_output=True)
    assert outputs(folder) == made


def test_make_and_ninja_know_the_files_that_steps_and_inputs_name(folder: Path, call: Call) -> None:
    write_crowd(folder, hero="biped")
    (folder / "crowd/arm 1.glb").unlink()
    call("convert", "crowd/hero.glb", "crowd/text.gltf").product()
    (buffer,) = (each.name for each in (folder / "crowd").glob("*.bin"))
    write_recipe(folder, "simulate springs --chain '*' --springs tail.json", match="crowd/*.gltf")
    assert f"build/crowd/text.gltf: crowd/text.gltf tail.json crowd/{buffer}\n" in call("run", "--emit", "make").text
    line = f"build build/crowd/text.gltf: recipe1 crowd/text.gltf | tail.json crowd/{buffer}\n"
    assert line in call("run", "--emit", "ninja").text


@pytest.mark.parametrize("tool", TOOLS)
def test_a_script_makes_first_what_the_steps_of_others_read(tool: str, folder: Path, call: Call) -> None:
    if shutil.which(TOOLS[tool][0]) is None:
        pytest.skip(f"{TOOLS[tool][0]} is not installed")
    (folder / "take.bvh").write_bytes(call("to-euler", "crowd/arm 1.glb", "-", "--clip", "#0").product())
    onto = "from-euler --onto build//x/../hero.glb"
    write_recipe(folder, onto, match="*.bvh", out="clips/{stem}.glb")
    write_recipe(folder, "resample --fps 12", match="crowd/*.glb", out="build/hero.glb")
    (folder / "script").write_bytes(call("run", "--emit", tool).product())
    (folder / "build/x").mkdir(parents=True)
    subprocess.run([*TOOLS[tool], "script"], cwd=folder, env=ENVIRONMENT, check=True, capture_output=True)
    assert (folder / "clips/take.glb").read_bytes() == call(*onto.split(), "take.bvh").product()


def test_make_refuses_names_that_it_can_not_have(folder: Path, call: Call) -> None:
    (folder / "crowd/arm 1.glb").rename(folder / "crowd/100%.glb")
    write_recipe(folder, "resample --fps 12")
    run = call("run", "--emit", "make")
    assert "'build/crowd/100%.glb': make has no names with '%'" in refusal(run, 2)
    assert help_line(run) == "--emit ninja or shell"
    assert "crowd/100%.glb" in call("run", "--emit", "shell").text


@pytest.mark.parametrize("tool", TOOLS)
def test_names_that_look_like_options_remain_names(tool: str, folder: Path, call: Call) -> None:
    if shutil.which(TOOLS[tool][0]) is None:
        pytest.skip(f"{TOOLS[tool][0]} is not installed")
    (folder / "crowd/arm 1.glb").rename(folder / "-x.glb")
    write_recipe(folder, "resample --fps 12", match="-*.glb", out="{stem}.small.glb")
    (folder / "script").write_bytes(call("run", "--emit", tool).product())
    subprocess.run([*TOOLS[tool], "script"], cwd=folder, env=ENVIRONMENT, check=True, capture_output=True)
    assert (folder / "-x.small.glb").is_file()


@pytest.mark.parametrize("name", ["a\nb", "a|b"])
def test_ninja_refuses_names_that_it_can_not_have(name: str, folder: Path, call: Call) -> None:
    """Without an escape the rest of the name was read as another line, or as another file."""
    (folder / "crowd/arm 1.glb").rename(folder / f"crowd/{name}.glb")
    write_recipe(folder, "resample --fps 12")
    run = call("run", "--emit", "ninja")
    assert f"ninja has no names with {name[1]!r}" in refusal(run, 2)
    assert help_line(run) == "--emit shell"


@pytest.mark.parametrize("tool", ["make", "ninja"])
@pytest.mark.parametrize("name", ["arm", "arm 1"])
def test_line_breaks_of_steps_begin_no_line_of_a_rule(name: str, tool: str, folder: Path, call: Call) -> None:
    (folder / "crowd/arm 1.glb").rename(folder / f"crowd/{name}.glb")
    write_recipe(folder, "resample --fps 12 --clip 'a*\n\ttouch made'")
    assert "a step has a line break" in refusal(call("run", "--emit", tool), 2)
    assert "touch made" in call("run", "--emit", "shell").text


@pytest.mark.parametrize("tool", TOOLS)
def test_names_that_are_no_utf8_keep_their_bytes(tool: str, folder: Path, call: Call) -> None:
    path = os.fsencode(folder / "crowd") + b"/a\xff.glb"
    try:
        os.rename(folder / "crowd/arm 1.glb", path)
    except OSError:
        pytest.skip("file names are UTF-8 here")
    write_recipe(folder, "resample --fps 12")
    assert b"build/crowd/a\xff.glb" in call("run", "--emit", tool).product()


def test_images_that_a_pipe_would_lose_are_refused(folder: Path, call: Call) -> None:
    call("convert", "crowd/arm 1.glb", "crowd/arm.gltf").product()
    path = folder / "crowd/arm.gltf"
    path.write_text(json.dumps({**json.loads(path.read_text()), "images": [{"uri": "skin.png"}]}))
    write_recipe(folder, "resample --fps 12", "optimize", match="crowd/*.gltf", out="build/{stem}.glb")
    run = call("run", "--emit", "shell")
    assert "its image 'skin.png' is another file" in refusal(run, 2)
    assert help_line(run) == '`gltf-anim run` copies it; for a script, take images in: steps = ["convert --embed", …]'
    (folder / "gltf-anim.toml").unlink()
    write_recipe(folder, "convert --embed", "resample --fps 12", match="crowd/*.gltf", out="build/{stem}.glb")
    assert "convert crowd/arm.gltf - --embed | gltf-anim resample" in call("run", "--emit", "shell").text


@pytest.mark.parametrize("tool", TOOLS)
def test_a_broken_input_is_named_and_left_out(tool: str, folder: Path, call: Call) -> None:
    (folder / "crowd/arm 1.glb").rename(folder / "crowd/arm.glb")
    (folder / "crowd/bad.glb").write_bytes((folder / "crowd/arm.glb").read_bytes()[:500])
    write_recipe(folder, "resample --fps 12")
    run = call("run", "--emit", tool)
    assert run.code == 3
    assert "gltf-anim: crowd/bad.glb: GLB is truncated" in run.err
    assert "build/crowd/arm.glb" in run.text
    assert "bad" not in run.text


@pytest.mark.parametrize("tool", TOOLS)
def test_names_that_commands_take_for_placeholders_are_refused(tool: str, folder: Path, call: Call) -> None:
    (folder / "crowd/arm 1.glb").rename(folder / "crowd/{x}.glb")
    write_recipe(folder, "resample --fps 12")
    assert "1 file: 1 made" in call("run").err
    assert "build/crowd/{x}.glb: {x} stands for nothing" in refusal(call("run", "--emit", tool), 2)


@pytest.mark.parametrize("shell", ["sh", "dash", "bash"])
def test_any_shell_runs_the_script_for_bash(shell: str, folder: Path, call: Call) -> None:
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed")
    write_recipe(folder, "resample --fps 12")
    (folder / "script").write_bytes(call("run", "--emit", "shell").product())
    subprocess.run([shell, "script"], cwd=folder, env=ENVIRONMENT, check=True, capture_output=True)
    assert (folder / "build/crowd/arm 1.glb").is_file()


def test_check_applies_the_rules_to_outputs(folder: Path, call: Call) -> None:
    write_recipe(folder, "resample --fps 12")
    run = call("run", "--check")
    assert run.code == 0
    assert "1 file checked" in run.text or "1 files checked" in run.text
    with (folder / "gltf-anim.toml").open("a") as file:
        file.write('[[budget]]\nmatch = "build/**"\nbytes = 1\n')
    run = call("run", "--check")
    assert run.code == 6
    assert "build/crowd/arm 1.glb: error GA402 over-budget" in run.err
    assert "were not checked" not in run.err
    (folder / "gltf-anim.toml").rename(folder / "other.toml")
    assert call("run", "--check", "--config", "other.toml").code == 6


def test_a_run_without_check_says_that_it_leaves_budgets_out(folder: Path, call: Call) -> None:
    write_recipe(folder, "resample --fps 12")
    settings = folder / "gltf-anim.toml"
    recipe = settings.read_text()
    settings.write_text(recipe + '[[budget]]\nmatch = "crowd/**"\nbytes = 1\n')
    assert "were not checked" not in call("run").err  # it is for the inputs
    settings.write_text(recipe + '[[budget]]\nmatch = "build/**"\nbytes = 1\n')
    words = "note: the budgets of gltf-anim.toml were not checked: `run --check` or `check` does that\n"
    assert call("run").err.endswith(words)
    assert call("run", "-q").err == ""
    settings.write_text(recipe + "[[budget]]\nbytes = 1\n")  # `check` would refuse it
    run = call("run")
    assert (run.code, "were not checked" in run.err) == (0, False)
