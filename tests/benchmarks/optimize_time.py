"""Time and memory of `optimize`, whole processes in turn with `gltf-transform resample`, on 1, 10 and all clips.

Memory is that of the process and all that it started, added up: its peak proportional set size (Linux), so that pages
which several processes share count once. The peer keeps no bound; it is only what a user would otherwise wait for.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from anim.gltf.document import Document, json_array
from anim.gltf.writing.insertion import insert_accessors
from cli import tables
from cli.text import format_bytes
from tests.benchmarks import peers
from tests.benchmarks.processes import environment
from tests.files import glb_of, opened_path

CLIPS = (1, 10, 76)
BOUND = "0.1%"
LOOK = 0.01  # s between two looks at memory
EFFORTS = ("fast", "balanced")
PEER = f"{peers.TRANSFORM} resample"


@dataclass
class Watched:
    """What the runs of one command took: seconds of wall time, bytes of memory at the peak."""

    seconds: list[float] = field(default_factory=list)
    peak: list[int] = field(default_factory=list)


def show(path: Path, runs: int) -> None:
    """Write a table for each number of clips to stdout, medians of so many runs after one that is thrown away."""
    document = opened_path(path)
    with tempfile.TemporaryDirectory() as folder:
        for count in CLIPS:
            source = Path(folder) / f"{path.stem}{count}.glb"
            source.write_bytes(glb_of(_with_clips(document, count)))
            _table(source, Path(folder) / "out.glb", f"{path.stem}, {count} clips", runs)


def _with_clips(document: Document, count: int) -> Document:
    """The document with its first `count` clips and what they need."""
    animations = json_array(document.json, "animations")
    return insert_accessors(document, animations[:count], set(range(count, len(animations))), [])


def _table(source: Path, output: Path, title: str, runs: int) -> None:
    ours = str(Path(sys.executable).parent / "gltf-anim")
    commands = {PEER: [peers.command(peers.TRANSFORM), "resample", str(source), str(output)]}
    for effort in EFFORTS:
        options = ["--max-error", BOUND, "--drop", "rest", "--effort", effort]
        commands[f"optimize --effort {effort}"] = [ours, "optimize", str(source), str(output), *options]
    found: dict[str, Watched] = {name: Watched() for name in commands}
    for number in range(runs + 1):
        for name, command in commands.items():
            output.unlink(missing_ok=True)  # what is there already with the same bytes would not be written
            seconds, peak = _watched(command)
            if number:  # the first run warms caches
                found[name].seconds.append(seconds)
                found[name].peak.append(peak)
    rows = [_row(name, each, found[PEER]) for name, each in found.items()]
    header = [title, "median", "fastest", "time / peer", "peak memory", "memory / peer"]
    print(tables.text(header, rows, indent=""))  # noqa: T201


def _row(name: str, each: Watched, peer: Watched) -> list[tables.Cell]:
    seconds, peak = statistics.median(each.seconds), statistics.median(each.peak)
    return [
        name,
        f"{seconds:.2f} s",
        f"{min(each.seconds):.2f} s",
        f"{seconds / statistics.median(peer.seconds):.2f} ×",
        format_bytes(round(peak)),
        f"{peak / statistics.median(peer.peak):.2f} ×",
    ]


def _watched(command: Sequence[str]) -> tuple[float, int]:
    began = time.perf_counter()
    process = subprocess.Popen(command, env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    peak = 0
    while process.poll() is None:
        peak = max(peak, sum(map(_memory, _family(process.pid))))
        time.sleep(LOOK)
    seconds = time.perf_counter() - began
    words = process.stderr.read().decode(errors="replace") if process.stderr else ""
    if process.returncode:
        raise RuntimeError(f"{' '.join(command)}: exit code {process.returncode}: {words}")
    return seconds, peak


def _family(pid: int) -> Iterable[int]:
    """The process and all below it."""
    yield pid
    for children in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in _text(children).split():
            yield from _family(int(child))


def _memory(pid: int) -> int:
    lines = _text(Path(f"/proc/{pid}/smaps_rollup")).splitlines()
    return next((1024 * int(line.split()[1]) for line in lines if line.startswith("Pss:")), 0)


def _text(path: Path) -> str:
    try:
        return path.read_text()
    except OSError:  # it has ended
        return ""
