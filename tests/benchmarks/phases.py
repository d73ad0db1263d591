"""Where one run of `resample` spends its time: the functions that it calls, each without those that it calls in turn.

python -m tests.benchmarks.phases IN OUT FPS → one JSON object, seconds by phase
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from typing import Any

BEGAN = time.perf_counter()

# Module, function, phase. A phase inside another one is not counted twice.
WATCHED = (
    ("anim.gltf.io.container", "read", "read the container and check its structure"),
    ("anim.gltf.reading.reader", "clips", "read clips (before and after)"),
    ("anim.gltf.reading.reader", "skeleton", "read the skeleton"),
    ("anim.gltf.reading.reader", "scene", "read meshes and skins"),
    ("anim.operations.resample", "resample", "resample"),
    ("anim.gltf.writing.writer", "replace_clips", "write clips into the document"),
    ("anim.gltf.io.container", "glb", "serialize"),
    ("cli.io.documents", "_replace", "write the file"),
)


class Clock:
    """Adds up the time of phases; the inner one of two that run is the one that counts."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._running: list[str] = []
        self._since = time.perf_counter()

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
        now = time.perf_counter()
        if self._running:
            self.seconds[self._running[-1]] = self.seconds.get(self._running[-1], 0.0) + now - self._since
        self._since = now
        change()


def main(source: str, target: str, fps: str) -> dict[str, float]:
    """Return the seconds of every phase of one run, imports first, what is not watched last."""
    import importlib

    from cli import main as command_line

    clock = Clock()
    for module, name, phase in WATCHED:
        owner = importlib.import_module(module)
        setattr(owner, name, clock.watched(getattr(owner, name), phase))
    from anim.measure.error.metric import ErrorMetric

    for method in ("__init__", "error"):
        setattr(ErrorMetric, method, clock.watched(getattr(ErrorMetric, method), "measure how far vertices move"))
    importlib.import_module("cli.commands.resample")
    imported = time.perf_counter()
    code = command_line.run(["resample", source, target, "--fps", fps, "--quiet"])
    if code:
        raise SystemExit(code)
    watched = dict(sorted(clock.seconds.items(), key=lambda each: -each[1]))
    rest = time.perf_counter() - imported - sum(watched.values())
    return {"import Python modules": imported - BEGAN, **watched, "everything else": rest}


if __name__ == "__main__":
    json.dump(main(*sys.argv[1:]), sys.stdout)
