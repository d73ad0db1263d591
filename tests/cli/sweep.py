"""Run command lines one after the other in one process and write what each did, with CPU time and memory, as JSON.

python -m tests.cli.sweep < [[arg, …], …] > [[exit code, stdout bytes, stderr text, seconds, peak bytes so far], …]
"""

from __future__ import annotations

import contextlib
import io
import json
import resource
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from cli import main

Outcome = tuple[int, int, str, float, int]
BYTES = 1 if sys.platform == "darwin" else 1024  # of the unit of ru_maxrss


def outcomes(lines: Sequence[Sequence[str]]) -> Iterator[Outcome]:
    """Yield exit code, length of stdout, stderr, seconds and the process's peak memory after each command line."""
    for line in lines:
        out, err = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True), io.StringIO()
        began = time.process_time()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = main.run(list(line))
        seconds = time.process_time() - began
        yield code, out.buffer.tell(), err.getvalue(), seconds, _peak()


def _peak() -> int:
    """Peak memory in bytes. Linux hands ru_maxrss on from the process that started this one, but not VmHWM."""
    status = Path("/proc/self/status")
    if status.exists():
        return 1024 * next(int(line.split()[1]) for line in status.read_text().splitlines() if line.startswith("VmHWM"))
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * BYTES


if __name__ == "__main__":
    json.dump(list(outcomes(json.load(sys.stdin))), sys.stdout)
