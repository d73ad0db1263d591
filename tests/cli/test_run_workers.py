"""Runs whose processes are ended: a worker, all of them, or the run itself."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from cli.workflows.run.job import Job, JobResult
from cli.workflows.run.run_job import shorten
from cli.workflows.run.workers import local_pool, run_jobs
from tests.cli.conftest import Call
from tests.cli.running import ENVIRONMENT, refusal, shell, started
from tests.cli.running_recipes import journal, statuses, write_long_run, write_recipe

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="processes are found in /proc")
NUM_FILES = 20
MAX_WAIT_S = 120.0  # of a busy machine


def answer(job: Job) -> JobResult:
    """End the process for one name."""
    if job.input == "bad":
        os._exit(9)
    return JobResult(0, (job.input,))


def jobs(*names: str) -> Iterator[Job]:
    for name in names:
        yield Job(Path(), name, name, ())


def test_the_job_that_ends_its_process_is_named_and_all_others_are_done() -> None:
    names = [str(number) for number in range(20)]
    names[7] = "bad"
    found = {job.input: result for job, result in run_jobs(jobs(*names), local_pool, 2, answer)}
    assert sorted(found) == sorted(names)
    assert [name for name, result in found.items() if result.code] == ["bad"]
    assert "bad: the process that worked on it was ended" in found["bad"].messages[0]


@pytest.fixture
def crowd(tmp_path: Path) -> Path:
    write_long_run(tmp_path, NUM_FILES)
    return tmp_path


def workers_of(run: subprocess.Popen[bytes]) -> list[int]:
    return [int(each) for each in Path(f"/proc/{run.pid}/task/{run.pid}/children").read_text().split()]


def wait_for_outputs(folder: Path, run: subprocess.Popen[bytes], count: int) -> None:
    """Wait until the journal has this number of files."""
    end = time.monotonic() + MAX_WAIT_S
    path = folder / ".gltf-anim-cache/journal.jsonl"
    while not path.exists() or path.read_text().count('"input"') < count:
        assert run.poll() is None, run.communicate()[1]
        assert time.monotonic() < end
        time.sleep(0.005)


def begin(folder: Path, *options: str) -> subprocess.Popen[bytes]:
    return started("run", "--config", folder / "gltf-anim.toml", "--jobs", "2", *options)


def is_alive(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def check_no_process(processes: list[int]) -> None:
    end = time.monotonic() + MAX_WAIT_S
    while any(map(is_alive, processes)):
        assert time.monotonic() < end
        time.sleep(0.01)


def is_complete(path: Path) -> bool:
    """Whether a GLB has as many bytes as its header states."""
    data = path.read_bytes()
    return data[:4] == b"glTF" and int.from_bytes(data[8:12], "little") == len(data)


def names_of(folder: Path) -> list[str]:
    """All files of the outputs' folder, hidden ones too."""
    return sorted(path.name for path in (folder / "build/crowd").iterdir())


@pytest.mark.slow
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM])
def test_a_worker_that_is_ended_costs_nothing(how: signal.Signals, crowd: Path) -> None:
    run = begin(crowd)
    wait_for_outputs(crowd, run, 2)
    os.kill(workers_of(run)[0], how)
    _, err = run.communicate(timeout=MAX_WAIT_S)
    assert run.returncode == 0, err
    assert f"{NUM_FILES} files: {NUM_FILES} made" in err.decode()
    assert set(statuses(crowd).values()) == {"made"}


@pytest.mark.parametrize(
    ("how", "options"),
    [
        pytest.param(signal.SIGKILL, (), marks=pytest.mark.slow),
        pytest.param(signal.SIGKILL, ("--no-cache",), marks=pytest.mark.slow),
        pytest.param(signal.SIGTERM, (), marks=pytest.mark.slow),
        (signal.SIGINT, ("--no-cache",)),
    ],
)
def test_a_run_that_is_ended_leaves_nothing_half_written_and_resumes(
    how: signal.Signals, options: tuple[str, ...], crowd: Path, call: Call
) -> None:
    run = begin(crowd, *options)
    wait_for_outputs(crowd, run, 3)
    processes = workers_of(run)
    assert len(processes) == 2
    run.send_signal(how)
    _, err = run.communicate(timeout=MAX_WAIT_S)
    assert run.returncode == (-how if how == signal.SIGKILL else 128 + how)
    assert b"Traceback" not in err
    assert (b"--resume continues" in err) == (how != signal.SIGKILL)
    check_no_process(processes)
    before = {entry["input"] for entry in journal(crowd)}
    assert 3 <= len(before) < NUM_FILES
    assert all(name.endswith(".glb") and not name.startswith(".") for name in names_of(crowd))
    stamps = {path.name: path.stat().st_mtime_ns for path in (crowd / "build/crowd").iterdir()}
    again = begin(crowd, "--resume", *options)
    _, err = again.communicate(timeout=MAX_WAIT_S)
    assert again.returncode == 0, err
    entries = journal(crowd)
    made = [entry["input"] for entry in entries if entry["status"] == "made"]
    assert len(made) == len(set(made))
    assert {entry["input"] for entry in entries if entry["status"] == "done before"} == before
    assert len(names_of(crowd)) == NUM_FILES
    for path in (crowd / "build/crowd").iterdir():
        assert is_complete(path)
        assert f"crowd/{path.name}" not in before or path.stat().st_mtime_ns == stamps[path.name]


@pytest.mark.slow
def test_jobs_in_one_process_and_in_several_make_the_same(crowd: Path, call: Call) -> None:
    subprocess.run([sys.executable, "-m", "anim", "run", "-q", "crowd/03.glb"], cwd=crowd, env=ENVIRONMENT, check=True)
    alone = (crowd / "build/crowd/03.glb").read_bytes()
    begin(crowd, "--no-cache", "-q").communicate(timeout=MAX_WAIT_S)
    assert (crowd / "build/crowd/03.glb").read_bytes() == alone


def test_many_messages_fit_in_the_buffer_of_a_pipe() -> None:
    for letter in ("x", "字"):
        lines = [f"{i}: {letter * 290}" for i in range(1000)]
        found = shorten(lines)
        left = 1001 - len(found)
        assert f"… {left} more lines" in found
        assert (found[0], found[-1]) == (lines[0], lines[-1])
        assert len(pickle.dumps(JobResult(0, found))) < 1 << 15
    assert shorten(lines[:30]) == tuple(lines[:30])
    assert shorten([]) == ()


@pytest.mark.parametrize("count", [5, 10, 14])
def test_too_few_open_files_for_workers_are_one_line(count: int, folder: Path) -> None:
    write_recipe(folder, "resample --fps 12", match="**/*.glb")
    run = shell(f"ulimit -n {count}; gltf-anim run --jobs 2", folder)
    assert "worker processes can't be started (too many open files)" in refusal(run, 4)
