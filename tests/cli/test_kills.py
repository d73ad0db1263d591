"""Whatever stops a run, and wherever: no file of the user is torn, mixed with another, or lost."""

from __future__ import annotations

import hashlib
import json
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cli import main
from tests.cli.conftest import Call
from tests.cli.running import ENVIRONMENT, ROOT, TIMEOUT, built, started

SLOW = pytest.mark.slow
HOWS = ("KILL", pytest.param("TERM", marks=SLOW), pytest.param("INT", marks=SLOW), "ERROR")
Files = dict[str, bytes]


def contents(folder: Path) -> Files:
    """All files of a folder but what is temporary."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if not path.name.startswith(".")}


def leftovers(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir() if path.name.startswith("."))


def check_leftovers(how: str, folder: Path) -> None:
    """None but what could not be removed, since that is what failed, or what a run that was killed could not."""
    assert how == "KILL" or len(leftovers(folder)) <= (how == "ERROR")


def meaning(name: str, files: Files) -> tuple[Any, ...]:
    """What a .gltf is, whatever its buffers are called. Fails where one of them is missing or too short."""
    document = json.loads(files[name])
    buffers = [files[each.pop("uri")] for each in document.get("buffers", ())]
    for about, data in zip(document.get("buffers", ()), buffers, strict=True):
        assert len(data) == about["byteLength"]
    return json.dumps(document), *(hashlib.sha256(data).hexdigest() for data in buffers)


def stopped(how: str, before: Path, out: Path, line: list[str]) -> list[Path]:
    """One folder for each place where the run was stopped, and the last one where it was not."""
    out.mkdir()
    command = [sys.executable, "-m", "tests.cli.killing", how, str(before), str(out), *line]
    environment = {**ENVIRONMENT, "PYTHONPATH": str(ROOT)}
    subprocess.run(command, cwd=ROOT, env=environment, timeout=4 * TIMEOUT, check=True, stderr=subprocess.DEVNULL)
    return sorted(out.iterdir(), key=lambda path: int(path.name))


def pair_in_place(folder: Path) -> list[str]:
    main.run(["convert", str(folder / "walk.glb"), str(folder / "walk.gltf"), "-q"])
    return ["resample", "walk.gltf", "walk.gltf", "--fps", "9"]


def pair_over_a_pair(folder: Path) -> list[str]:
    pair_in_place(folder)
    (folder / "arm.glb").write_bytes(built("arm"))
    return ["convert", "arm.glb", "walk.gltf"]


def pair_beside_its_source(folder: Path) -> list[str]:
    """A .gltf that was renamed, so that its buffer has the name that the output would take."""
    pair_in_place(folder)
    (folder / "walk.gltf").rename(folder / "model.gltf")
    return ["resample", "model.gltf", "walk.gltf", "--fps", "5"]


def pair_where_nothing_is(folder: Path) -> list[str]:
    return ["resample", "walk.glb", "new.gltf", "--fps", "9"]


PAIRS = [
    pair_in_place,
    pytest.param(pair_over_a_pair, marks=SLOW),
    pytest.param(pair_beside_its_source, marks=SLOW),
    pytest.param(pair_where_nothing_is, marks=SLOW),
]


@pytest.mark.slow
@pytest.mark.parametrize("how", HOWS)
@pytest.mark.parametrize("case", PAIRS, ids=lambda case: case.__name__)
def test_a_pair_is_the_old_one_or_the_new_one(
    how: str, case: Callable[[Path], list[str]], walk: Path, tmp_path: Path
) -> None:
    before = tmp_path / "before"
    before.mkdir()
    walk.rename(before / "walk.glb")
    line = case(before)
    old = contents(before)
    folders = stopped(how, before, tmp_path / "out", line)
    new, target = contents(folders[-1]), line[2]
    assert len(folders) > 6
    assert meaning(target, new) != (meaning(target, old) if target in old else None)
    for folder in folders:
        now = contents(folder)
        for name in old:
            if name.endswith(".gltf") and name != target:
                assert meaning(name, now) == meaning(name, old)
            if name.endswith(".glb"):
                assert now[name] == old[name]
        if target in old or target in now:
            assert meaning(target, now) in [meaning(target, each) for each in (old, new) if target in each]
        check_leftovers(how, folder)
        if how != "KILL":
            assert now in (old, new) or meaning(target, now) == meaning(target, new)
    assert leftovers(folders[-1]) == []


def pc2(folder: Path) -> list[str]:
    main.run(["bake", str(folder / "walk.glb"), str(folder / "c.pc2"), "--clip", "walk", "-q"])
    return ["bake", "walk.glb", "c.pc2", "--clip", "walk", "--fps", "7", "--up", "z"]


def texture(folder: Path) -> list[str]:
    main.run(["bake", str(folder / "walk.glb"), str(folder / "c.png"), "--clip", "walk", "-q"])
    return ["bake", "walk.glb", "c.png", "--clip", "walk", "--fps", "7", "--up", "z"]


def sequence(folder: Path) -> list[str]:
    main.run(["bake", str(folder / "walk.glb"), str(folder / "c.ply"), "--clip", "walk", "--fps", "4", "-q"])
    return ["bake", "walk.glb", "c.ply", "--clip", "walk", "--fps", "4", "--method", "dqs"]


@pytest.mark.slow
@pytest.mark.parametrize("how", HOWS)
@pytest.mark.parametrize(
    ("case", "first"),
    [
        pytest.param(pc2, "c.pc2", id="pc2", marks=SLOW),
        pytest.param(texture, "c.png", id="texture"),
        pytest.param(sequence, "c_00001.ply", id="sequence", marks=SLOW),
    ],
)
def test_a_cache_and_its_companions_are_one_set_or_lack_the_main_file(
    how: str, case: Callable[[Path], list[str]], first: str, walk: Path, tmp_path: Path
) -> None:
    before = tmp_path / "before"
    before.mkdir()
    walk.rename(before / "walk.glb")
    line = case(before)
    old = contents(before)
    folders = stopped(how, before, tmp_path / "out", line)
    new = contents(folders[-1])
    assert set(new) == set(old)
    assert sum(new[name] != old[name] for name in old) > 1
    for folder in folders:
        now = contents(folder)
        if how == "KILL" and first not in now:
            hidden = [path.read_bytes() for path in folder.iterdir() if path.name.startswith(".")]
            assert all(data in hidden or now.get(name) == data for name, data in old.items())  # nothing is lost
        else:
            assert now in (old, new)
        check_leftovers(how, folder)


@SLOW
def test_random_kills_leave_whole_pairs(call: Call, walk: Path, tmp_path: Path) -> None:
    chosen, count = random.Random(60), 60
    call("convert", walk, tmp_path / "a.gltf", "-q").product()
    rates = [str(5 + i) for i in range(count)]
    seen = set()
    for fps in rates:
        run = started("resample", tmp_path / "a.gltf", tmp_path / "a.gltf", "--fps", fps, "-q")
        time.sleep(chosen.uniform(0.2, 1.2))
        run.send_signal(signal.SIGKILL)
        run.communicate(timeout=TIMEOUT)
        seen.add(meaning("a.gltf", contents(tmp_path)))
    assert len(seen) >= 1


@pytest.mark.slow
def test_writers_of_one_file_leave_a_whole_one_and_readers_find_one(call: Call, walk: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.gltf"
    call("resample", walk, out, "--fps", "4", "-q").product()
    writers = [started("resample", walk, out, "--fps", str(5 + i), "-q") for i in range(8)]
    readers = [started("resample", out, tmp_path / f"read-{i}.glb", "--fps", "3", "-q") for i in range(4)]
    for run in (*writers, *readers):
        _, err = run.communicate(timeout=2 * TIMEOUT)
        assert (run.returncode, err) == (0, b"")
    files = contents(tmp_path)
    meaning("out.gltf", files)
    assert len([name for name in files if name.endswith(".bin")]) == 1
    assert leftovers(tmp_path) == []
