"""`run` with a cache that somebody else has made: it may not reach files elsewhere, nor end with a traceback."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.cli.running_recipes import write_recipe

CACHE = ".gltf-anim-cache"


@pytest.fixture
def made(folder: Path, call: Call) -> Path:
    """A folder after a run of one file, in a folder with other files."""
    write_recipe(folder, "resample --fps 12")
    call("run").product()
    return folder


def add_output(folder: Path, name: str, path: Path) -> None:
    """Name a file as an output of an earlier run."""
    record = folder / CACHE / "outputs.json"
    content = json.loads(record.read_text())
    found = path.stat()
    content["folders"][str(folder)][name] = ["gone.glb", [found.st_size, found.st_mtime_ns]]
    record.write_text(json.dumps(content))


@pytest.mark.parametrize("name", ["../{}/mine.glb", "{}/mine.glb", "/", "way/mine.glb", "link.glb", "notes.txt"])
def test_only_outputs_below_the_folder_are_deleted(
    name: str, made: Path, call: Call, tmp_path_factory: pytest.TempPathFactory
) -> None:
    outside = tmp_path_factory.mktemp("outside")
    for path in (outside / "mine.glb", made / "notes.txt"):
        path.write_bytes(b"mine")
    (made / "way").symlink_to(outside)
    (made / "link.glb").symlink_to(outside / "mine.glb")
    name = name.format(outside.name if name.startswith(".") else outside)
    add_output(made, name, outside / "mine.glb" if name.endswith(".glb") else made / name)
    run = call("run", "--delete-stale")
    assert (run.code, "note" in run.err) == (0, False)
    assert (outside / "mine.glb").exists()
    assert (made / "link.glb").is_symlink()
    assert (made / "notes.txt").exists()
