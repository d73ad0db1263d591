"""python -m tests.benchmarks.recipes [--files N]: `run` on many files, and single commands on some, in one run.

Copies of Fox with small changes: a first run, a second one, one changed file, and a run killed in the middle and
resumed; then some of the files by a shell loop of single commands, and by the peer's `resample`, a process a file. CPU
is user and system time of all processes.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from tests.benchmarks.__main__ import ROOT, _peer
from tests.benchmarks.processes import environment
from tests.cli.running_recipes import variant

FILE = ROOT.parent / "shared" / "assets" / "Fox.glb"
RECIPE = """[[recipe]]
match = "in/*.glb"
steps = ["retime --speed 0.5", "resample --fps 30"]
out = "out/{name}"
"""
NUM_SINGLE = 20  # files for single commands
OURS = [sys.executable, "-m", "anim"]


def main(arguments: Sequence[str]) -> int:
    """Return the exit code; the table goes to stdout."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.recipes")
    parser.add_argument("--files", type=int, default=1000, help="number of copies (default 1000)")
    parser.add_argument("--file", type=Path, default=FILE, help="a .glb (default shared/assets/Fox.glb)")
    given = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "gltf-anim.toml").write_text(RECIPE)
        (folder / "in").mkdir()
        data = given.file.read_bytes()
        for number in range(given.files):
            (folder / f"in/{number:04}.glb").write_bytes(variant(data, number))
        _write_row("", "wall", "CPU", "CPU a file")
        run = [*OURS, "run", "-q"]
        _measure("first run", run, folder, given.files)
        first = _outputs(folder)
        _measure("second run", run, folder, given.files)
        (folder / "in/0000.glb").write_bytes(variant(data, -1))
        _measure("one changed file", run, folder, 1)
        _kill_and_resume(folder, given.files, first)
        _single_commands(folder, given.files)
    return 0


def _kill_and_resume(folder: Path, files: int, first: dict[str, bytes]) -> None:
    """Kill a run without a cache in the middle, and resume it; every file is made once."""
    subprocess.run(["rm", "-rf", "out", ".gltf-anim-cache"], cwd=folder, check=True)
    run = subprocess.Popen([*OURS, "run", "-q"], cwd=folder, env=environment())
    while len(list(folder.glob("out/*.glb"))) < files // 2:
        time.sleep(0.01)
    run.send_signal(signal.SIGKILL)
    run.wait()
    before = len(_entries(folder))
    _measure(f"resume after kill -9 at {before} files", [*OURS, "run", "-q", "--resume"], folder, files - before)
    made = [entry["input"] for entry in _entries(folder) if entry["status"] == "made"]
    assert len(made) == len(set(made)), "a file was made twice"
    after = _outputs(folder)
    assert after.keys() == first.keys()
    assert all(after[name] == data for name, data in first.items() if name != "0000.glb"), "other bytes"


def _single_commands(folder: Path, files: int) -> None:
    count = min(NUM_SINGLE, files)
    some = [f"in/{number:04}.glb" for number in range(count)]
    emit = [*OURS, "run", "--emit", "shell", *some]
    script = subprocess.run(emit, cwd=folder, env=environment(), capture_output=True, check=True)
    text = script.stdout.decode().replace("gltf-anim ", " ".join(OURS) + " ")
    _measure("single commands, a shell loop", ["bash", "-c", text], folder, count)
    _measure("the same files by run, without cache", [*OURS, "run", "-q", "--no-cache", *some], folder, count)
    peer = _peer()
    if peer is not None:
        loop = f'for f in {" ".join(some)}; do {peer} resample "$f" out/peer.glb; done'
        _measure("gltf-transform resample, a shell loop", ["bash", "-c", loop], folder, count)


def _measure(name: str, command: Sequence[str], folder: Path, files: int) -> None:
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, cwd=folder, env=environment(), check=True, capture_output=True)
    wall = time.perf_counter() - began
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    _write_row(name, f"{wall:.2f} s", f"{cpu:.2f} s", f"{1000 * cpu / max(files, 1):.1f} ms")


def _write_row(*cells: str) -> None:
    print("".join(cell.ljust(40) if i == 0 else cell.rjust(12) for i, cell in enumerate(cells[:4])), flush=True)  # noqa: T201


def _entries(folder: Path) -> list[dict[str, str]]:
    lines = (folder / ".gltf-anim-cache/journal.jsonl").read_text().split("\n")
    found = []
    for line in lines:
        try:
            entry = json.loads(line)
        except ValueError:  # cut off
            continue
        if "input" in entry:
            found.append(entry)
    return found


def _outputs(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in (folder / "out").glob("*.glb")}


if __name__ == "__main__":
    os.environ.setdefault("PYTHONPATH", str(ROOT))
    sys.exit(main(sys.argv[1:]))
