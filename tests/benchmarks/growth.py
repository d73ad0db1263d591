"""CPU time and peak memory against the number of clips, the duration and the number of nodes.

python -m tests.benchmarks.growth [COMMAND …] [--limit SECONDS] [--drawing OUT.png]

Each run is a process of its own on a skinned rig of this module. A row has the exponent of the growth from the count
before: 1 is linear. `>` marks a run that was ended at the limit of CPU time, `!` one that failed.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from anim.arrays import Floats
from fixtures.broken.pieces import glb
from tests.benchmarks.processes import environment

SERIES = {"clips": (1, 10, 76, 760), "seconds": (60, 600, 6000), "nodes": (20, 200, 2000)}
DEFAULT = {"clips": 1, "seconds": 2, "nodes": 24}  # of the counts that a series does not vary
LINES = {
    "optimize": "optimize IN OUT --effort fast --jobs 1 -q",
    "resample": "resample IN OUT --fps 15 -q",
    "inspect": "inspect IN",
}
FPS = 30
SPEEDS = np.array([0.31, 0.9, 2.3])  # Hz, of the waves in every motion
MEMORY_LIMIT_BYTES = 8_000_000_000  # of address space
CORNERS = 0.05 * np.array([[x, y, z] for x in (-1, 1) for y in (0, 2) for z in (-1, 1)])  # m, of one joint


@dataclass(frozen=True)
class Run:
    """CPU seconds and peak memory in bytes of one process. mark: of a run that did not end well, else empty."""

    cpu: float
    peak: int
    mark: str = ""


class _File:
    """A document with its buffer, built accessor by accessor."""

    def __init__(self) -> None:
        self.json: dict[str, Any] = {"asset": {"version": "2.0"}, "accessors": [], "bufferViews": []}
        self._parts: list[bytes] = []
        self._length = 0

    def accessor(self, kind: str, values: Any, component: int = 5126) -> int:
        """Add values, and return the index of their accessor."""
        array = np.ascontiguousarray(values, {5126: "<f4", 5123: "<u2"}[component])
        view = {"buffer": 0, "byteOffset": self._length, "byteLength": array.nbytes}
        about = {"bufferView": len(self.json["bufferViews"]), "componentType": component, "type": kind}
        about["count"] = len(array)
        if kind == "VEC3" or kind == "SCALAR":
            rows = array.reshape(len(array), -1)
            about |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.json["bufferViews"].append(view)
        self.json["accessors"].append(about)
        self._parts.append(array.tobytes() + bytes(-array.nbytes % 4))
        self._length += len(self._parts[-1])
        return len(self.json["accessors"]) - 1

    def glb(self) -> bytes:
        """Return the file."""
        document = {**self.json, "buffers": [{"byteLength": self._length}]}
        return glb(json.dumps(document, separators=(",", ":")).encode(), b"".join(self._parts))


def rig(clips: int, seconds: float, nodes: int) -> bytes:
    """Return a skinned binary tree of nodes, whose rotations all move in every clip, at 30 keys per second."""
    file = _File()
    places = [[0.3 * (1 - 2 * (i % 2)), 0.5, 0.1] if i else [0, 0, 0] for i in range(nodes)]
    children = [[k for k in (2 * i + 1, 2 * i + 2) if k < nodes] for i in range(nodes)]
    file.json["nodes"] = [
        {"name": f"n{i}", "translation": places[i], **({"children": children[i]} if children[i] else {})}
        for i in range(nodes)
    ]
    file.json["nodes"].append({"name": "body", "mesh": 0, "skin": 0})
    file.json |= {"scene": 0, "scenes": [{"nodes": [0, nodes]}]}
    world = np.array(places, float)
    for i in range(1, nodes):
        world[i] += world[(i - 1) // 2]
    _add_skin(file, world)
    generator = np.random.default_rng(19)
    times = np.arange(round(FPS * seconds) + 1) / FPS
    at = file.accessor("SCALAR", times)
    animations = []
    for clip in range(clips):
        outputs = [file.accessor("VEC4", _rotations(times, generator)) for _ in range(nodes)]
        animations.append(
            {
                "name": f"clip {clip}",
                "samplers": [{"input": at, "output": output} for output in outputs],
                "channels": [{"sampler": i, "target": {"node": i, "path": "rotation"}} for i in range(nodes)],
            }
        )
    file.json["animations"] = animations
    return file.glb()


def _add_skin(file: _File, world: Floats) -> None:
    """Add a mesh of eight vertices around each of the joints at `world` (N, 3), bound to it."""
    inverse = np.tile(np.eye(4), (len(world), 1, 1))
    inverse[:, 3, :3] = -world  # column-major
    joints = np.zeros((len(world), 8, 4), np.int64)
    joints[..., 0] = np.arange(len(world))[:, None]
    weights = np.zeros((len(world) * 8, 4))
    weights[:, 0] = 1
    attributes = {
        "POSITION": file.accessor("VEC3", (world[:, None] + CORNERS).reshape(-1, 3)),
        "JOINTS_0": file.accessor("VEC4", joints.reshape(-1, 4), 5123),
        "WEIGHTS_0": file.accessor("VEC4", weights),
    }
    file.json["meshes"] = [{"primitives": [{"attributes": attributes, "mode": 0}]}]
    matrices = file.accessor("MAT4", inverse.reshape(-1, 16))
    file.json["skins"] = [{"joints": list(range(len(world))), "inverseBindMatrices": matrices}]


def _rotations(times: Floats, generator: np.random.Generator) -> Floats:
    """Rotations (K, 4) of a joint: waves about all three axes."""
    phases = generator.uniform(0, 2 * np.pi, (3, len(SPEEDS)))
    sizes = generator.uniform(0.02, 0.12, (3, len(SPEEDS))) / np.sqrt(SPEEDS)
    vector = (sizes * np.sin(2 * np.pi * SPEEDS * times[:, None, None] + phases)).sum(axis=2)
    rows = np.column_stack([vector, np.ones(len(times))])
    return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))


def _write_rig(path: Path, counts: dict[str, int]) -> None:
    """Write a rig from a process of its own: a peak of this one would count for all processes that it starts."""
    code = f"from pathlib import Path; from tests.benchmarks.growth import rig; Path({str(path)!r}).write_bytes(rig("
    subprocess.run([sys.executable, "-c", f"{code}**{counts!r}))"], env=environment(), check=True)


def measure(line: str, folder: Path, limit: int) -> Run:
    """Return the cost of one command line on `in.glb` in a folder. limit: s of CPU time."""
    import resource  # Windows has none, and the gate tests the rest of this module

    def restrict() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 1))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT_BYTES, MEMORY_LIMIT_BYTES))

    words = [{"IN": "in.glb", "OUT": "out.glb"}.get(word, word) for word in line.split()]
    environ = {"OPENBLAS_NUM_THREADS": "1", **environment()}
    process = subprocess.Popen(
        [sys.executable, "-m", "anim", *words], cwd=folder, env=environ, preexec_fn=restrict,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    _, status, usage = os.wait4(process.pid, 0)
    code = process.returncode = os.waitstatus_to_exitcode(status)
    mark = ">" if code in (-9, -24) else "!" if code else ""
    return Run(usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024, mark)


def exponents(counts: Sequence[float], values: Sequence[float]) -> list[float]:
    """Return the exponent of the growth between neighboring counts."""
    return list((np.diff(np.log(values)) / np.diff(np.log(counts))).tolist())


def main(arguments: Sequence[str]) -> None:
    """Print the table, and draw it if asked to."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.growth")
    parser.add_argument("commands", nargs="*", default=[])
    parser.add_argument("--limit", type=int, default=120)
    parser.add_argument("--drawing", type=Path)
    given = parser.parse_args(arguments)
    found: dict[str, dict[str, dict[int, Run]]] = {}
    for series, counts in SERIES.items():
        for count in counts:
            with tempfile.TemporaryDirectory() as folder:
                _write_rig(Path(folder) / "in.glb", {**DEFAULT, series: count})
                for name in given.commands or LINES:
                    run = measure(LINES[name], Path(folder), given.limit)
                    found.setdefault(series, {}).setdefault(name, {})[count] = run
                    words = f"{run.mark}{run.cpu:.2f} s {run.peak / 1e6:.0f} MB"
                    print(f"{series:8} {count:5} {name:9} {words}", flush=True)  # noqa: T201
        for name, runs in found[series].items():
            growth = [
                " ".join(f"{each:.2f}" for each in exponents(list(runs), values))
                for values in ([run.cpu for run in runs.values()], [float(run.peak) for run in runs.values()])
            ]
            print(f"{series:8} {'':5} {name:9} exponents of CPU {growth[0]}, of memory {growth[1]}", flush=True)  # noqa: T201
    if given.drawing:
        given.drawing.write_bytes(_drawing(found))


def _drawing(found: dict[str, dict[str, dict[int, Run]]]) -> bytes:
    """Panels of CPU time and memory for every series, with a dashed line of linear growth. Return a PNG file."""
    from anim.show.plots.figure import COLORS, SMALL, SOFT, TITLE, Figure, style

    width, height, left, top = 2.6, 2.2, 0.75, 0.8
    with style("png"):
        sheet = Figure(left + 3 * (width + 0.75), top + 2 * (height + 0.75))
        sheet.text(left, 0.35, "growth of CPU time and peak memory", fontsize=TITLE + 2, weight="bold")
        for column, (series, commands) in enumerate(found.items()):
            for row, (name, unit) in enumerate((("CPU time", "s"), ("peak memory", "MB"))):
                axes = sheet.panel(left + column * (width + 0.75), top + row * (height + 0.75), width, height)
                axes.set_title(f"{name}, {unit}, over {series}", fontsize=SMALL)
                for color, (command, runs) in zip(COLORS, commands.items(), strict=False):
                    counts = list(runs)
                    values = [run.cpu if unit == "s" else run.peak / 1e6 for run in runs.values()]
                    axes.loglog(counts, values, color=color, marker="o", markersize=4, label=command)
                    linear = [values[-1] * count / counts[-1] for count in counts]
                    axes.loglog(counts, linear, color=color, linestyle=(0, (4, 3)), linewidth=0.7)
                axes.set_ylim(bottom=0.1 if unit == "s" else 20)
                axes.yaxis.set_major_formatter("{x:g}")
                axes.set_xticks(counts, [str(count) for count in counts])
                axes.minorticks_off()
                if not column and not row:
                    axes.legend(fontsize=SMALL, frameon=False)
        sheet.text(left, 0.58, "dashed: linear to the last count", fontsize=SMALL, color=SOFT)
        return sheet.render("png")


if __name__ == "__main__":
    main(sys.argv[1:])
