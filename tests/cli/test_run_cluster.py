"""`run --scheduler`: a dask scheduler and its workers, each a process of its own."""

from __future__ import annotations

import importlib.util
import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.cli.running import ENVIRONMENT, ROOT, help_line, refusal, started
from tests.cli.running_recipes import journal, write_long_run

needs_dask = pytest.mark.skipif(importlib.util.find_spec("distributed") is None, reason="distributed is not installed")
NUM_FILES = 16
MAX_WAIT_S = 120.0  # of a busy machine


@contextmanager
def process(*words: str, folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A process of dask, ended with the block."""
    environment = {**ENVIRONMENT, "PYTHONPATH": str(ROOT)}
    with (folder / f"{words[0]}.log").open("ab") as log:
        found = subprocess.Popen([sys.executable, "-m", *words], cwd=folder, env=environment, stdout=log, stderr=log)
        try:
            yield found
        finally:
            found.kill()
            found.wait()


def wait_for(path: Path, words: str, count: int, run: subprocess.Popen[bytes] | None = None) -> None:
    """Wait until a file has these words as many times."""
    end = time.monotonic() + MAX_WAIT_S
    while not path.exists() or path.read_text().count(words) < count:
        assert run is None or run.poll() is None, run.communicate()[1]
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.fixture
def crowd(tmp_path: Path) -> Path:
    write_long_run(tmp_path, NUM_FILES)
    return tmp_path


def outputs(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in (folder / "build/crowd").iterdir()}


@pytest.mark.slow
@needs_dask
def test_workers_of_a_cluster_make_the_same_bytes_also_if_one_is_killed(
    crowd: Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(crowd)
    call("run", "--no-cache", "-q", "--jobs", "1").product()
    expected = outputs(crowd)
    assert len(expected) == NUM_FILES
    with ExitStack() as stack:
        words = ["distributed.cli.dask_scheduler", "--port", "0", "--no-dashboard", "--scheduler-file", "cluster.json"]
        stack.enter_context(process(*words, folder=crowd))
        wait_for(crowd / "cluster.json", "address", 1)
        words = ["distributed.cli.dask_worker", "--nthreads", "1", "--no-nanny", "--no-dashboard"]
        words += ["--scheduler-file", "cluster.json"]
        dask = [stack.enter_context(process(*words, folder=crowd)) for _ in range(2)]
        wait_for(crowd / "distributed.cli.dask_worker.log", "Registered to", 2)
        address = json.loads((crowd / "cluster.json").read_text())["address"]
        for path in (crowd / "build/crowd").iterdir():
            path.unlink()
        (crowd / ".gltf-anim-cache/journal.jsonl").unlink()
        run = started("run", "--config", crowd / "gltf-anim.toml", "--scheduler", address)
        wait_for(crowd / ".gltf-anim-cache/journal.jsonl", '"input"', 3, run)
        dask[0].send_signal(signal.SIGKILL)
        _, err = run.communicate(timeout=MAX_WAIT_S)
        assert run.returncode == 0, err
    assert outputs(crowd) == expected
    assert sorted(entry["input"] for entry in journal(crowd)) == [f"crowd/{each:02}.glb" for each in range(NUM_FILES)]
    assert {entry["status"] for entry in journal(crowd)} == {"made"}


@needs_dask
def test_an_address_without_a_scheduler_is_refused(crowd: Path, call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(crowd)
    monkeypatch.setattr("cli.workflows.run.cluster.MAX_CONNECT_S", 0.3)
    assert "--scheduler tcp://127.0.0.1:1: can't be reached" in refusal(
        call("run", "--scheduler", "tcp://127.0.0.1:1"), 2
    )


@needs_dask
@pytest.mark.parametrize("address", ["slurm:16", "k8s://pods", "PBS"])
def test_queues_are_no_addresses(address: str, crowd: Path, call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    """That waited for ten seconds, and named a host."""
    monkeypatch.chdir(crowd)
    assert f"--scheduler {address}: {address[:3].lower()}" in refusal(call("run", "--scheduler", address), 2)


def test_without_dask_the_extra_is_named(crowd: Path, call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(crowd)
    monkeypatch.setitem(sys.modules, "distributed", None)
    run = call("run", "--scheduler", "tcp://127.0.0.1:1")
    assert "--scheduler needs the package distributed" in refusal(run, 4)
    assert help_line(run) == "pip install 'gltf-anim[cluster]'"
