"""`run` with a cache that somebody else has made: it may not reach files elsewhere, nor end with a traceback."""

from __future__ import annotations

import json
import os
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import Call
from tests.cli.running import refusal, shell
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
    content["folders"][str(folder)][name] = ["gone.glb", [found.st_size, found.st_mtime_ns], "gltf-anim.toml"]
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


@pytest.mark.parametrize("name", ["../{}/mine.png", "{}/mine.png", "way/mine.png", "link.png", "notes.txt"])
def test_only_images_below_the_folder_are_deleted(
    name: str, made: Path, call: Call, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Where a stale output names them, and the record says that a run copied them."""
    outside = tmp_path_factory.mktemp("outside")
    for path in (outside / "mine.png", made / "notes.txt"):
        path.write_bytes(b"mine")
    (made / "way").symlink_to(outside)
    (made / "link.png").symlink_to(outside / "mine.png")
    name = name.format(outside.name if name.startswith(".") else outside)
    (made / "old.gltf").write_text(json.dumps({"asset": {"version": "2.0"}, "images": [{"uri": name}]}))
    add_output(made, "old.gltf", made / "old.gltf")
    record, found = made / CACHE / "outputs.json", (made / name).stat()
    content = json.loads(record.read_text())
    content["copies"] = {str(made): {name: [found.st_size, found.st_mtime_ns]}}
    record.write_text(json.dumps(content))
    assert "(old.gltf): deleted\n" in call("run", "--delete-stale").err
    assert (outside / "mine.png").exists()
    assert (made / "link.png").is_symlink()
    assert (made / "notes.txt").exists()


@pytest.mark.parametrize("name", ["", "journal.jsonl", "outputs.json", "objects", "results"])
@pytest.mark.parametrize("args", [(), ("--resume",)])
def test_nothing_is_written_through_links_of_the_cache(
    name: str, args: tuple[str, ...], made: Path, call: Call, tmp_path_factory: pytest.TempPathFactory
) -> None:
    target, path = tmp_path_factory.mktemp("outside") / "mine", made / CACHE / name
    shutil.move(path, target)
    path.symlink_to(target)
    before = contents(target)
    run = call("run", *args)
    assert f"{path}: is a link" in refusal(run, 3)
    assert contents(target) == before


def contents(path: Path) -> dict[Path, bytes]:
    """Files of a folder, or the file itself."""
    return {each: each.read_bytes() for each in (path, *path.rglob("*")) if each.is_file()}


def test_a_cache_that_the_user_names_may_be_a_link(
    made: Path, call: Call, tmp_path_factory: pytest.TempPathFactory
) -> None:
    (made / "c").symlink_to(tmp_path_factory.mktemp("large"))
    assert "1 made" in call("run", "--cache", "c").err
    assert "1 cached" in call("run", "--cache", "c").err


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no `ulimit -f`")
@pytest.mark.parametrize("args", ["", "--jobs 1"])
def test_a_journal_that_can_not_be_written_is_one_line(args: str, made: Path) -> None:
    (made / CACHE / "journal.jsonl").write_bytes(b"\n" * 1024)
    run = shell(f"export PYTHONDONTWRITEBYTECODE=1; ulimit -f 1; gltf-anim run --resume {args}", made)
    assert "journal.jsonl: can't be written (file too large)" in refusal(run, 3)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no named pipes")
@pytest.mark.parametrize("name", ["outputs.json", "objects/*/*", "results/*/*"])
def test_pipes_in_the_cache_are_as_if_absent(name: str, made: Path, call: Call) -> None:
    (path,) = (made / CACHE).glob(name)
    path.unlink()
    os.mkfifo(path)
    (made / "build/crowd/arm 1.glb").unlink()
    call("run", "-q").product()
    assert (made / "build/crowd/arm 1.glb").exists()
    assert path.is_file()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no named pipes")
@pytest.mark.parametrize("args", [(), ("--resume",)])
def test_a_pipe_as_journal_is_replaced(args: tuple[str, ...], made: Path, call: Call) -> None:
    path = made / CACHE / "journal.jsonl"
    path.unlink()
    os.mkfifo(path)
    assert "1 file: 1 cached" in call("run", *args).err
    assert path.is_file()


@pytest.mark.parametrize("name", ["journal.jsonl", "outputs.json"])
@pytest.mark.parametrize("args", [(), ("--resume",)])
def test_a_file_with_a_second_name_in_the_cache_is_left_as_it_is(
    args: tuple[str, ...], name: str, made: Path, call: Call
) -> None:
    mine, path = made / "noop.glb", made / CACHE / name
    before = mine.read_bytes()
    path.unlink()
    os.link(mine, path)
    assert "1 file: 1 " in call("run", *args).err
    assert mine.read_bytes() == before
    assert json.loads(path.read_bytes().splitlines()[-1])


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no `ulimit -v`")
@pytest.mark.parametrize(
    ("name", "args"),
    [("journal.jsonl", "--resume"), ("outputs.json", ""), ("outputs.json", "--resume"), ("results/*/*", "")],
)
def test_a_record_of_gigabytes_is_as_if_absent(name: str, args: str, made: Path) -> None:
    (path,) = (made / CACHE).glob(name)
    os.truncate(path, 3_000_000_000)
    run = shell(f"ulimit -v 3000000; gltf-anim run {args}", made)
    assert "1 file: 1 " in run.err
    assert (run.code, path.stat().st_size < 1_000_000) == (0, True)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no /dev")
@pytest.mark.parametrize("name", ["/dev/zero", "/proc/self/pagemap", "pipe"])
def test_devices_that_a_record_names_are_not_read(name: str, made: Path, call: Call) -> None:
    os.mkfifo(made / "pipe")
    edit_record(made, files={name: "x"})
    assert "1 file: 1 made" in call("run").err


def edit_record(folder: Path, **values: Any) -> None:
    """Change the record of the only result."""
    (path,) = (folder / CACHE / "results").glob("*/*")
    path.write_text(json.dumps({**json.loads(path.read_text()), **values}))


@pytest.mark.parametrize(
    "values",
    [
        {"messages": [1]},
        {"messages": 5},
        {"size": "x"},
        {"size": None},
        {"size": float("inf")},
        {"size": -1},
        {"status": []},
        {"files": []},
        {"files": {"x": [float("inf"), 1]}},
        {"output_stamp": [1]},
    ],
)
def test_a_wrong_entry_of_a_journal_is_as_if_absent(values: dict[str, Any], made: Path, call: Call) -> None:
    path = made / CACHE / "journal.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    path.write_text("".join(json.dumps({**line, **values} if "input" in line else line) + "\n" for line in lines))
    run = call("run", "--resume", "--verbose")
    run.product()
    assert "1 file: 1 cached" in run.err


@pytest.mark.parametrize(
    "values", [{"size": 10**400}, {"size": -5}, {"is_plain": []}, {"files": {"x": 5}}, {"step_errors": [5]}]
)
def test_a_wrong_record_of_a_result_is_as_if_absent(values: dict[str, Any], made: Path, call: Call) -> None:
    edit_record(made, **values)
    assert "1 file: 1 made" in call("run", "--verbose").err


@pytest.mark.parametrize(
    "value", [["a.glb", [float("inf"), 2], "x"], ["a.glb", 5, "x"], [1, [1, 2], "x"], ["a.glb", [1, 2], 3], 5]
)
def test_a_wrong_entry_of_outputs_costs_no_other(value: object, made: Path, call: Call) -> None:
    path = made / CACHE / "outputs.json"
    content = json.loads(path.read_text())
    content["folders"][str(made)]["build/x.glb"] = value
    path.write_text(json.dumps(content))
    (made / "crowd/arm 1.glb").unlink()
    assert "(build/crowd/arm 1.glb)" in call("run").err


def test_other_files_in_the_folder_of_the_cache_are_not_deleted(made: Path, call: Call) -> None:
    mine = [made / "c/objects/aa/mine.blend", made / f"c/objects/aa/{'b' * 64}"]
    call("run", "--cache", "c").product()
    mine[0].parent.mkdir(exist_ok=True)
    for path in mine:
        path.write_bytes(bytes(10_000))
    write_recipe(made, "resample --fps 6", out="other/{name}")
    assert "2 results" in call("run", "--cache", "c", "--cache-size", "1kB").err
    assert all(path.exists() for path in mine)
