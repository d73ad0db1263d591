"""CPU seconds and peak memory of every command on files of many items: python -m tests.benchmarks.many [INPUT|COMMAND]…

Each run is a process of its own under limits. A row has one column a count; a time that grows faster than the count
is work above linear. `!` and the exit code follow a run that did not end with 0 or 6, `>` one cut at the limit.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from tests import many
from tests.benchmarks.processes import environment

COUNTS = (5_000, 10_000, 20_000)
CPU_LIMIT_S = 30
MEMORY_LIMIT_BYTES = 6_000_000_000  # of address space
LINES = (
    "inspect IN",
    "check IN",
    "convert IN out.glb",
    "sample IN --fps 4",
    "resample IN out.glb --fps 5",
    "ease IN out.glb --ease sine-in-out",
    "spline IN out.glb --tangents catmull-rom",
    "retime IN out.glb --speed 2",
    "trim IN out.glb --to 0.5",
    "loop IN",
    "loop IN out.glb --blend 0.2",
    "to-euler IN out.bvh --clip #0",
    "to-euler IN out.json --clip #0",
    "bake IN out.npz --fps 4 --rigid --clip #0",
    "bake IN {clip}.npz --fps 4 --rigid",
    "plot IN out.png --clip #0",
    "view IN -o out.html",
    "render IN out.png --frames 2 --clip #0",
    "collapse IN",
    "diff IN IN",
    "optimize IN out.glb --effort fast --jobs 1",
    "optimize IN out.glb --jobs 1",
)
EULER_LINES = {
    ".csv": "from-euler IN out.glb --order XYZ --axes extrinsic --unit deg",
    ".bvh": "from-euler IN out.glb",
    ".json": "from-euler IN out.glb",
}


def main() -> None:
    """Print the table of the command line: words choose inputs by name, or command lines by a part of them."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.many")
    parser.add_argument("words", nargs="*")
    parser.add_argument("--counts", type=int, nargs="+", default=COUNTS)
    given = parser.parse_args()
    inputs = [word for word in given.words if word in {name for name, *_ in cases()}]
    lines = [word for word in given.words if word not in inputs]
    for name, ending, line, make in cases():
        if (not inputs or name in inputs) and (not lines or any(word in line for word in lines)):
            row = " ".join(f"{measured(make(count), ending, line):>16}" for count in given.counts)
            print(f"{name:16}{line:50}{row}", flush=True)  # noqa: T201


def cases() -> Iterator[tuple[str, str, str, many.Make]]:
    """Yield inputs with their file name's ending, and command lines."""
    for name, make in many.GLTF.items():
        for line in LINES:
            yield name, ".glb", line, make
    for name, (kind, make) in many.PHYSICS.items():
        for line in (f"simulate {kind} IN out.glb --fps 10", "inspect IN", "check IN"):
            yield name, ".glb", line, make
    for name, (ending, make) in many.EULER.items():
        yield name, ending, EULER_LINES[ending], make


def measured(data: bytes, ending: str, line: str) -> str:
    """Return CPU seconds and peak MB of a command line on a file."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / f"in{ending}").write_bytes(data)
        words = [f"in{ending}" if word == "IN" else word for word in line.split()]
        process = subprocess.Popen(
            [sys.executable, "-m", "anim", *words], cwd=folder, env=environment(), preexec_fn=_limit,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        _, status, usage = os.wait4(process.pid, 0)
        code = process.returncode = os.waitstatus_to_exitcode(status)
    cut = ">" if code in (-9, -24) else ""
    odd = f"!{code}" if code not in (0, 6) and not cut else ""
    return f"{cut}{usage.ru_utime + usage.ru_stime:.1f} s {usage.ru_maxrss / 1024:.0f} MB{odd}"


def _limit() -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_LIMIT_S, CPU_LIMIT_S + 1))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT_BYTES, MEMORY_LIMIT_BYTES))


if __name__ == "__main__":
    main()
