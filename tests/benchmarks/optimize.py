"""Bytes of `optimize` against the best that other tools reach within the same bound, by the same independent judge.

    python -m tests.benchmarks.optimize [Fox …] [--bounds 1e-3 1e-4] [--modes core ext khr] [--effort balanced]
    python -m tests.benchmarks.optimize --peers     # theirs alone
    python -m tests.benchmarks.optimize --time      # time and memory against `gltf-transform resample`

Bounds are shares of the diagonal. A row's cost is that of the animations alone, see tests.benchmarks.animation_cost;
its error is what three.js shows, see tests.judge; peers' settings are searched, see tests.benchmarks.peers. `--drop
rest` matches what gltfpack drops. An output of ours beyond its bound is an error, not a row.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cli import tables
from tests.benchmarks import peers
from tests.benchmarks.animation_cost import Cost, animation_cost
from tests.benchmarks.optimize_time import show
from tests.files import ASSETS
from tests.judge import judge

NAMES = ("Fox", "CesiumMan", "Knight", "Robot", "BitmojiRun")
BOUNDS = (1e-3, 1e-4)
ARGUMENTS = {"core": (), "ext": ("--meshopt", "ext"), "khr": ("--meshopt", "khr")}
GOALS = {("core", 1e-3): 0.70, ("ext", 1e-3): 0.72, ("core", 1e-4): 0.80, ("ext", 1e-4): 0.78}  # geometric means
REBASED = ("Robot", 3e-4, 48_000)  # asset, bound, bytes: with --rebase-rest --meshopt ext


@dataclass(frozen=True, slots=True)
class Ours:
    """What `optimize` made of a file: its cost, and its error as a share of the diagonal."""

    cost: Cost
    error: float


def main(arguments: Sequence[str]) -> int:
    """Return the exit code: 1 where a goal is missed. Tables go to stdout."""
    given = _parser().parse_args(arguments)
    if given.time:
        show(ASSETS / "Knight.glb", given.runs)
        return 0
    missed: list[str] = []
    for bound in given.bounds:
        for mode in given.modes:
            missed += _table(given, mode, bound)
    if not given.peers and REBASED[0] in given.assets:
        missed += _rebased(given.effort)
    for each in missed:
        sys.stderr.write(f"missed: {each}\n")
    return 1 if missed else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.optimize", description="Bytes at equal error.")
    parser.add_argument("assets", nargs="*", default=NAMES, help="names in shared/assets")
    parser.add_argument("--bounds", type=float, nargs="+", default=BOUNDS, help="shares of the diagonal")
    parser.add_argument("--modes", nargs="+", choices=peers.MODES, default=("core", "ext"))
    parser.add_argument("--effort", default="balanced", help="of optimize")
    parser.add_argument("--lenience", type=float, default=0, help="share of the bound by which peers may miss it")
    parser.add_argument("--peers", action="store_true", help="what is to be beaten, and nothing of ours")
    parser.add_argument("--time", action="store_true", help="time and memory instead of bytes")
    parser.add_argument("--runs", type=int, default=3, help="of each command, with --time (default 3)")
    return parser


def _table(given: argparse.Namespace, mode: str, bound: float) -> list[str]:
    """Write one table; return what was missed in it."""
    rows: list[list[tables.Cell]] = []
    ratios: dict[str, float] = {}
    for name in given.assets:
        source = ASSETS / f"{name}.glb"
        ours = None if given.peers else optimized(source, bound, (*ARGUMENTS[mode], "--effort", given.effort))
        best = peers.cheapest(source, mode, bound * (1 + given.lenience))
        if ours and best:
            ratios[name] = ours.cost.total / best.cost.total
        rows.append([name, *_our_cells(ours), *_peer_cells(best), f"{ratios[name]:.3f}" if name in ratios else ""])
    print(f"{mode}, bound {bound:g} of the diagonal")  # noqa: T201
    header = ["asset", "ours", "data + JSON", "error", "best peer", "data + JSON", "error", "setting", "ratio"]
    print(tables.text(header, rows, indent=""))  # noqa: T201
    return _judged(ratios, mode, bound)


def _judged(ratios: dict[str, float], mode: str, bound: float) -> list[str]:
    if not ratios:
        return []
    mean = math.exp(sum(map(math.log, ratios.values())) / len(ratios))
    goal = GOALS.get((mode, bound))
    print(f"geometric mean {mean:.3f}" + (f" (goal {goal:.2f})" if goal else "") + "\n")  # noqa: T201
    missed = [f"{name}, {mode}, {bound:g}: {ratio:.3f}" for name, ratio in ratios.items() if ratio > 1]
    if goal and mean > goal and set(ratios) == set(NAMES):
        missed.append(f"{mode}, {bound:g}: geometric mean {mean:.3f} (goal {goal})")
    return missed


def _our_cells(ours: Ours | None) -> list[tables.Cell]:
    return ["", "", ""] if ours is None else [*_cost_cells(ours.cost), f"{ours.error:.2e}"]


def _peer_cells(best: peers.Result | None) -> list[tables.Cell]:
    if best is None:
        return ["none", "", "", ""]
    return [*_cost_cells(best.cost), f"{best.error or 0:.2e}", best.setting]


def _cost_cells(cost: Cost) -> list[tables.Cell]:
    return [f"{cost.total}", f"{cost.data} + {cost.json}"]


def optimized(source: Path, bound: float, options: Sequence[str]) -> Ours:
    """Return what `optimize --drop rest` makes of a file within a bound.

    Raises RuntimeError where it fails, and where the judge says otherwise.
    """
    command = Path(sys.executable).parent / "gltf-anim"
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "out.glb"
        limit = f"{100 * bound:.10g}%"
        call = [command, "optimize", source, output, "--max-error", limit, "--drop", "rest", *options]
        run = subprocess.run([*map(str, call)], capture_output=True, text=True)
        if run.returncode:
            raise RuntimeError(f"{source.name}, {bound:g}, {' '.join(options)}: {run.stderr}")
        verdict = judge(source, output)
        if verdict.share > bound or not verdict.by_vertex or verdict.missing:
            raise RuntimeError(f"{source.name}, {bound:g}, {' '.join(options)}: {verdict.share:.3e}, {verdict.worst}")
        return Ours(animation_cost(output), verdict.share)


def _rebased(effort: str) -> list[str]:
    """Write the one line about --rebase-rest; return what was missed."""
    name, bound, goal = REBASED
    ours = optimized(ASSETS / f"{name}.glb", bound, ("--rebase-rest", "--meshopt", "ext", "--effort", effort))
    words = f"{name} --rebase-rest --meshopt ext at {bound:g}: {ours.cost.total} B (goal {goal}), {ours.error:.2e}"
    print(words)  # noqa: T201
    return [words] if ours.cost.total > goal else []


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
