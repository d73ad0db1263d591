"""python -m tests.benchmarks [--runs N] [--file FILE.glb]: our commands against glTF-Transform's, in one run.

The peer is the npm package @gltf-transform/cli: its command is taken from $GLTF_TRANSFORM, from `node_modules` beside
pyproject.toml, or from the PATH. Runs of both take turns, so that a busy machine is busy for both.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from cli import tables
from cli.text import format_bytes, format_length
from tests.benchmarks.processes import Measured, environment, interleaved

ROOT = Path(__file__).resolve().parents[2]
FILE = ROOT.parent / "shared" / "assets" / "Knight.glb"
FPS = "30"
OURS, PEER = "gltf-anim", "gltf-transform"


def main(arguments: Sequence[str]) -> int:
    """Return the exit code; tables go to stdout, remarks to stderr."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks", description="Time, memory and error, with peers."
    )
    parser.add_argument("--runs", type=int, default=7, help="runs of each command (default 7)")
    parser.add_argument("--file", type=Path, default=FILE, help="a .glb with clips (default shared/assets/Knight.glb)")
    given = parser.parse_args(arguments)
    ours = str(Path(sys.executable).parent / OURS)
    peer = _peer()
    with tempfile.TemporaryDirectory() as folder:
        source = _source(given.file, Path(folder))
        print(f"{source.name}, {format_bytes(source.stat().st_size)}, median of {given.runs} runs in turn\n")  # noqa: T201
        outputs = {name: str(Path(folder) / f"{name}.glb") for name in (OURS, PEER)}
        _report("inspect", ours, peer, [str(source)], [str(source)], given.runs)
        _report(
            "resample",
            ours,
            peer,
            [str(source), outputs[OURS], "--fps", FPS],
            [str(source), outputs[PEER]],
            given.runs,
        )
        _outputs(source, outputs)
        _phases(source, outputs[OURS])
    _starts(ours, peer, given.runs)
    return 0


def _peer() -> str | None:
    given = os.environ.get("GLTF_TRANSFORM")
    local = ROOT / "node_modules" / ".bin" / PEER
    found = given or (str(local) if local.exists() else shutil.which(PEER))
    if found is None:
        sys.stderr.write(f"note: no peer: {PEER} is not installed (npm install @gltf-transform/cli@4.5, or set ")
        sys.stderr.write("GLTF_TRANSFORM to its command); only our own figures follow\n\n")
    return found


def _source(path: Path, folder: Path) -> Path:
    if path.is_file():
        return path
    sys.stderr.write(f"note: {path} is not there; the fixture 'biped' is measured instead\n\n")
    script = "import fixtures, sys; sys.stdout.buffer.write(fixtures.build('biped'))"
    (folder / "biped.glb").write_bytes(subprocess.run([sys.executable, "-c", script], capture_output=True).stdout)
    return folder / "biped.glb"


def _report(verb: str, ours: str, peer: str | None, our_options: list[str], peer_options: list[str], runs: int) -> None:
    commands = {OURS: [ours, verb, *our_options]}
    if peer is not None:
        commands[PEER] = [peer, verb, *peer_options]
    found = interleaved(commands, runs=runs)
    rows: list[list[tables.Cell]] = [_row(each, found.get(PEER)) for each in found.values()]
    _show([verb, "median", "fastest", "slowest", "time / peer", "peak memory", "memory / peer"], rows)


def _row(each: Measured, peer: Measured | None) -> list[tables.Cell]:
    return [
        each.name,
        f"{each.median_s:.3f} s",
        f"{min(each.seconds):.3f} s",
        f"{max(each.seconds):.3f} s",
        f"{each.median_s / peer.median_s:.2f} ×" if peer else "",
        format_bytes(round(each.median_peak)),
        f"{each.median_peak / peer.median_peak:.2f} ×" if peer else "",
    ]


def _outputs(source: Path, outputs: dict[str, str]) -> None:
    """What the two `resample`s wrote: ours puts keys on a grid, the peer's drops keys that it finds superfluous."""
    rows: list[list[tables.Cell]] = []
    for name, path in outputs.items():
        if Path(path).is_file():
            found = _json("tests.benchmarks.error", str(source), path)
            share = f"{100 * found['share']:.2g} %"
            rows.append([name, format_bytes(Path(path).stat().st_size), format_length(found["max_error_m"]), share])
    _show(["output of resample", "size", "max error", "of the diagonal"], rows)


def _phases(source: Path, output: str) -> None:
    Path(output).unlink()
    found = _json("tests.benchmarks.phases", "resample", str(source), output, "--fps", FPS, "--quiet")
    total = sum(found.values())
    rows: list[list[tables.Cell]] = [
        [name, f"{each:.3f} s", f"{100 * each / total:.0f} %"] for name, each in found.items()
    ]
    _show(["phase of resample (one run)", "CPU", "fraction"], rows)


def _starts(ours: str, peer: str | None, runs: int) -> None:
    python = [sys.executable, "-c"]
    commands = {
        "python -c pass": [*python, "pass"],
        "import typer": [*python, "import typer"],
        "import numpy": [*python, "import numpy"],
        "import anim.gltf.reading.reader": [*python, "import anim.gltf.reading.reader"],
        f"{OURS} --help": [ours, "--help"],
        f"{OURS} resample --help": [ours, "resample", "--help"],
    }
    if peer is not None:
        commands[f"{PEER} --help"] = [peer, "--help"]
    found = interleaved(commands, runs=runs)
    bare = found["python -c pass"].median_s
    rows: list[list[tables.Cell]] = [
        [
            each.name,
            f"{1000 * each.median_s:.0f} ms",
            f"{each.median_s / bare:.1f} ×",
            format_bytes(round(each.median_peak)),
        ]
        for each in found.values()
    ]
    _show(["start", "median", "of bare Python", "peak memory"], rows)


def _json(module: str, *arguments: str) -> dict[str, float]:
    command = [sys.executable, "-m", module, *arguments]
    run = subprocess.run(command, cwd=ROOT, env=environment(), capture_output=True, check=True)
    found: dict[str, float] = json.loads(run.stdout)
    return found


def _show(header: list[str], rows: list[list[tables.Cell]]) -> None:
    print(tables.text(header, rows, indent=""))  # noqa: T201


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
