"""Folders that can't be read: their files are not as if deleted."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import Call
from tests.cli.running import built, refusal
from tests.cli.running_recipes import PLAIN, built_files, run_with_a_deleted_input, write_recipe


@pytest.fixture
def refuse(monkeypatch: pytest.MonkeyPatch) -> Callable[[Path], None]:
    """Return a function that takes the permission to list a folder away, also from root."""

    def patch(folder: Path) -> None:
        scan = os.scandir

        def scandir(path: Any = ".") -> Any:
            if os.path.realpath(path) == str(folder.resolve()):
                raise PermissionError(13, "Permission denied", str(folder))
            return scan(path)

        monkeypatch.setattr(os, "scandir", scandir)

    return patch


def test_a_run_ends_before_outputs_are_stale(folder: Path, call: Call, refuse: Callable[[Path], None]) -> None:
    """It left them out without a word, and --delete-stale deleted their outputs."""
    (folder / "crowd/deep").mkdir()
    (folder / "crowd/deep/hero.glb").write_bytes(built("biped"))
    write_recipe(folder, *PLAIN)
    call("run").product()
    before = built_files(folder)
    refuse(folder / "crowd/deep")
    run = call("run", "--delete-stale")
    assert "crowd/deep: can't be read (permission denied)" in refusal(run, 3)
    assert built_files(folder) == before


def test_a_folder_that_no_recipe_matches_may_be_unreadable(
    folder: Path, call: Call, refuse: Callable[[Path], None]
) -> None:
    (folder / "secret").mkdir()
    write_recipe(folder, *PLAIN)
    refuse(folder / "secret")
    assert "made" in call("run").err


def test_a_folder_too_deep_for_a_recipe_may_be_unreadable(
    folder: Path, call: Call, refuse: Callable[[Path], None]
) -> None:
    """All of them below the fixed part of `match` ended the run, such as a system's own lost+found."""
    (folder / "crowd/deep").mkdir()
    write_recipe(folder, *PLAIN, match="crowd/*.glb")
    refuse(folder / "crowd/deep")
    assert "made" in call("run").err


def test_images_stay_if_a_folder_may_need_them(folder: Path, call: Call, refuse: Callable[[Path], None]) -> None:
    made = run_with_a_deleted_input(folder, call)
    call("convert", "crowd/hero.glb", "crowd/hero.gltf").product()
    path = made / "crowd/hero.gltf"
    path.write_text(path.read_text().replace("{", '{"images": [{"uri": "skin.png"}],', 1))
    (made / "crowd/skin.png").write_bytes(b"\x89PNG")
    (made / "gltf-anim.toml").unlink()
    write_recipe(made, *PLAIN, match="crowd/*.gl*")
    call("run", "--delete-stale").product()
    (made / "secret").mkdir()
    path.unlink()
    refuse(made / "secret")
    assert "(build/crowd/hero.gltf): deleted\n" in call("run", "--delete-stale").err
    assert "build/crowd/skin.png" in built_files(made)


FOLDERS = (
    ("check", "crowd"),
    ("inspect", "crowd"),
    ("convert", "crowd", "-o", "out/{path}"),
    ("check", "crowd/**/*.glb"),
    ("check", "crowd/*/*.glb"),
)


@pytest.mark.parametrize("command", FOLDERS)
def test_commands_on_folders_name_it(
    command: tuple[str, ...], folder: Path, call: Call, refuse: Callable[[Path], None]
) -> None:
    (folder / "crowd/deep").mkdir()
    refuse(folder / "crowd/deep")
    assert "crowd/deep: can't be read (permission denied)" in refusal(call(*command), 3)


def test_a_pattern_names_no_folder_that_it_does_not_reach(
    folder: Path, call: Call, refuse: Callable[[Path], None]
) -> None:
    (folder / "crowd/deep").mkdir()
    refuse(folder / "crowd/deep")
    assert call("inspect", "crowd/*.gl[b]").code == 0
