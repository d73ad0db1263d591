"""Seconds of CPU by phase of one run of a command: each function without those that it calls in turn.

python -m tests.benchmarks.phases [FILE ...] [--effort NAME] → a table of `optimize` on each file, fractions by phase
python -m tests.benchmarks.phases resample IN OUT --fps FPS → one JSON object, seconds by phase, of any such command
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

IMPORTS, REST = "import", "everything else"
COMMANDS = ("resample", "optimize")
DEFAULT_FILES = ("Knight.glb", "Fox.glb", "Robot.glb", "BusterDrone/busterDrone.gltf", "BitmojiRun.glb")
OPTIONS = ("--max-error", "0.1%", "--drop", "rest", "--jobs", "1", "--quiet")

# Module, function or method, phase. A phase inside another one is not counted twice.
READING = (
    ("anim.gltf.io.container", "read", "read"),
    ("anim.gltf.reading.reader", "clips", "read"),
    ("anim.gltf.reading.reader", "skeleton", "read"),
    ("anim.gltf.reading.reader", "scene", "read"),
)
WRITING = (
    ("anim.gltf.writing.writer", "replace_clips", "write"),
    ("anim.gltf.io.container", "glb", "write"),
    ("cli.io.documents", "write", "write"),
)
WATCHED = {
    "resample": (
        *READING,
        ("anim.operations.resample", "resample", "resample"),
        ("anim.measure.error.metric", "ErrorMetric.__init__", "verification"),
        ("anim.measure.error.metric", "ErrorMetric.error", "verification"),
        *WRITING,
    ),
    "optimize": (
        *READING,
        ("anim.optimization.optimize", "find_constants", "analysis"),
        ("anim.optimization.clip_optimizer", "build_context", "analysis"),
        ("anim.optimization.search.lockstep", "analyze_sources", "analysis"),
        ("anim.optimization.search.lockstep", "StackedClips", "analysis"),
        ("anim.optimization.search.lockstep", "ClipTrials", "analysis"),
        ("anim.optimization.search.lockstep", "BoundUsage", "analysis"),
        ("anim.optimization.clip", "_TrackSorter", "tracks"),
        ("anim.optimization.clip", "_tracks", "tracks"),
        ("anim.optimization.clip", "_with_ends", "tracks"),
        ("anim.optimization.search.lockstep", "run_searches", "search"),
        ("anim.optimization.clip_optimizer", "drop_redundant_keys", "redundant keys"),
        ("anim.optimization.clip_optimizer", "verify_clips", "verification"),
        ("anim.measure.error.metric", "ErrorMetric.__init__", "verification"),
        ("anim.measure.continuous_bound.prover", "Prover.__init__", "proof"),
        ("anim.measure.continuous_bound.prover", "Prover.certify", "proof"),
        ("anim.optimization.optimize", "write_solutions", "write"),
        *WRITING,
    ),
}
PHASES = (IMPORTS, "read", "analysis", "tracks", "search", "verification", "proof", "redundant keys", "write", REST)


class Clock:
    """Adds up the time of phases; the inner one of two that run is the one that counts."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._running: list[str] = []
        self._since = time.process_time()

    def watched(self, function: Callable[..., Any], phase: str) -> Callable[..., Any]:
        """Return the function, its time counted as this phase."""

        def call(*args: Any, **options: Any) -> Any:
            self._switch(lambda: self._running.append(phase))
            try:
                return function(*args, **options)
            finally:
                self._switch(self._running.pop)

        return call

    def _switch(self, change: Callable[[], Any]) -> None:
        now = time.process_time()
        if self._running:
            self.seconds[self._running[-1]] = self.seconds.get(self._running[-1], 0.0) + now - self._since
        self._since = now
        change()


def measure(arguments: Sequence[str]) -> dict[str, float]:
    """Return the seconds of CPU of every phase of one run, imports first, what is not watched last."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does, before it imports numpy
    from cli import main as command_line

    clock, command = Clock(), arguments[0]
    importlib.import_module(f"cli.commands.{command}")
    for module, name, phase in WATCHED[command]:
        owner: Any = importlib.import_module(module)
        *outer, last = name.split(".")
        for each in outer:
            owner = getattr(owner, each)
        setattr(owner, last, clock.watched(getattr(owner, last), phase))
    imported = time.process_time()
    code = command_line.run(list(arguments))
    if code:
        raise SystemExit(code)
    watched = dict(sorted(clock.seconds.items(), key=lambda each: -each[1]))
    rest = time.process_time() - imported - sum(watched.values())
    return {IMPORTS: imported, **watched, REST: rest}


def show(files: Sequence[Path], effort: str) -> None:
    """Write the table of `optimize` to stdout: seconds of CPU, and the percentage of every phase."""
    from cli import tables
    from tests.benchmarks.processes import environment

    rows: list[list[tables.Cell]] = []
    for path in files:
        with tempfile.TemporaryDirectory() as folder:
            output = str(Path(folder) / "out.glb")
            command = ["optimize", str(path), output, *OPTIONS, "--effort", effort]
            run = subprocess.run(
                [sys.executable, "-m", "tests.benchmarks.phases", *command],
                env=environment(),
                capture_output=True,
                check=True,
            )
        found: dict[str, float] = json.loads(run.stdout)
        total = sum(found.values())
        shown = [f"{100 * found.get(phase, 0.0) / total:.0f} %" for phase in PHASES]
        rows.append([path.stem, f"{total:.2f} s", *shown])
    print(tables.text([f"optimize --effort {effort}", "CPU", *PHASES], rows, indent=""))  # noqa: T201


def main(arguments: Sequence[str]) -> None:
    """Measure one command, or show the table of `optimize`."""
    if arguments[:1] and arguments[0] in COMMANDS:
        json.dump(measure(arguments), sys.stdout)
        return
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.phases")
    parser.add_argument("files", nargs="*", type=Path, default=_shared_files())
    parser.add_argument("--effort", default="fast")
    given = parser.parse_args(arguments)
    show([path for path in given.files if path.is_file()], given.effort)


def _shared_files() -> list[Path]:
    from tests.files import ASSETS

    return [ASSETS / name for name in DEFAULT_FILES]


if __name__ == "__main__":
    main(sys.argv[1:])
