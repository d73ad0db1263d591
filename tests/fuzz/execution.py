"""Run many command lines in forked processes, each in a folder of its own and under limits of CPU time and memory."""

from __future__ import annotations

import io
import json
import os
import resource
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import asdict, dataclass, field
from pathlib import Path

from cli import main
from tests.fuzz import usd_layers

CPU_LIMIT_S = 10.0
MEMORY_LIMIT_BYTES = 4_000_000_000  # of address space: native packages reserve more than they use
BATCH = 40  # command lines per process: forking takes as long as a short command


@dataclass(frozen=True, slots=True)
class Job:
    """A command line, the files in its folder, and the option that alone can be at fault, if they are sound."""

    line: Sequence[str]
    files: Mapping[str, bytes]
    option: str = ""


@dataclass(frozen=True, slots=True)
class Outcome:
    """Exit code (negative: the signal that ended it), stderr, CPU seconds, peak bytes, and problems of its outputs."""

    code: int
    err: str = ""
    cpu_s: float = 0.0
    peak_bytes: int = 0
    problems: list[str] = field(default_factory=list)


# Command line, exit code, new files, stdout, stderr → problems of the outputs.
Look = Callable[[Sequence[str], int, Sequence[str], bytes, str], list[str]]


def run_jobs(jobs: Sequence[Job], look: Look = lambda *_: []) -> Iterator[Outcome]:
    """Yield the outcome of each job. A job that ends its process is followed by a new process.

    look: called in the job's folder when its command has ended.
    """
    at = 0
    while at < len(jobs):
        end = min(len(jobs), at + BATCH)
        reading, writing = os.pipe()
        sys.stdout.flush()
        sys.stderr.flush()
        child = os.fork()
        if child == 0:
            os.close(reading)
            _work(jobs[at:end], writing, look)
        os.close(writing)
        with os.fdopen(reading, "rb") as pipe:
            found = [Outcome(**json.loads(each)) for each in pipe if each.endswith(b"\n")]
        _, status = os.waitpid(child, 0)
        yield from found
        at += len(found)
        if at < end:
            yield Outcome(-abs(os.waitstatus_to_exitcode(status)) or -1)
            at += 1


def _work(jobs: Sequence[Job], writing: int, look: Look) -> None:
    """Never returns."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(nowhere, stream)
    signal.signal(signal.SIGXCPU, signal.SIG_DFL)
    for job in jobs:
        folder = tempfile.mkdtemp()
        try:
            outcome = _one(job, Path(folder), look)
        except BaseException as error:
            outcome = Outcome(-99, repr(error))
        finally:
            os.chdir("/")
            shutil.rmtree(folder, ignore_errors=True)
        os.write(writing, json.dumps(asdict(outcome)).encode() + b"\n")
    os._exit(0)


def _one(job: Job, folder: Path, look: Look) -> Outcome:
    for name, data in job.files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)
    os.chdir(folder)
    sys.stdin = io.TextIOWrapper(io.BytesIO())
    _limit()
    before = _cpu_s()
    out, err = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = usd_layers.run(job.line) if job.line[0] == usd_layers.NAME else main.run(list(job.line))
    seconds, peak = _cpu_s() - before, _peak_bytes()
    new = sorted(path.name for path in folder.iterdir() if path.name not in job.files)
    buffer = out.buffer
    assert isinstance(buffer, io.BytesIO)
    return Outcome(code, err.getvalue(), seconds, peak, look(job.line, code, new, buffer.getvalue(), err.getvalue()))


def _limit() -> None:
    """Set the limits for the next job, and reset the peak of memory."""
    _, most = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (int(_cpu_s() + CPU_LIMIT_S) + 1, most))
    status = _status()
    if not status:
        return
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (1024 * int(status["VmSize"]) + MEMORY_LIMIT_BYTES, most))
    Path("/proc/self/clear_refs").write_text("5")


def _cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def _peak_bytes() -> int:
    """Peak memory since the last reset; 0 where the system does not tell."""
    return 1024 * int(_status().get("VmHWM", "0"))


def _status() -> dict[str, str]:
    path = Path("/proc/self/status")
    if not path.exists():
        return {}
    rows = (line.split() for line in path.read_text().splitlines())
    return {row[0].rstrip(":"): row[1] for row in rows if len(row) > 1}
