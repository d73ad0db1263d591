"""python -m tests.fuzz [FAMILY ...] [--count N] [--seed S] [--seconds T] [--sweep] [--keep FOLDER]: fuzz the commands.
python -m tests.fuzz --options [COMMAND ...] [--count N] [--seed S] [--seconds T] [--keep FOLDER]: fuzz their options.

Families: gltf, euler, cache, usd, usd-layers, springs, bodies, settings, and rigs, whose outputs are judged; all if
none is given. Runs mutations of fixtures until N of each family are done, or T seconds have passed; prints each new
kind of fault, and keeps its input in FOLDER, as one JSON file. With --sweep the mutations are not random: every value
of every JSON is replaced by each of a list. With --options files are sound: every option that takes a value and names
no file gets each of another list, in an order by chance, and a fault is printed with the shortest command line that has
it. A kept file in tests/fuzz/found is a test from then on.
"""

from __future__ import annotations

import argparse
import base64
import importlib
import itertools
import json
import re
import shlex
import sys
import time
import warnings
import zlib
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path

from tests.fuzz import usd_layers
from tests.fuzz.execution import BATCH, Job, Outcome, run_jobs
from tests.fuzz.families import FAMILIES, jobs, look, problems, sound_jobs
from tests.fuzz.options import option_jobs, plain_jobs, shorten
from tests.fuzz.sweep import sweep_jobs


def main() -> int:
    """Run the fuzzers of the command line; return 1 if there was a fault."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description="Fuzz the commands.")
    parser.add_argument("families", nargs="*", default=[])
    parser.add_argument("--count", type=int, default=10**9)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=3600)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--sweep", action="store_true")
    parser.add_argument("--options", action="store_true")
    parser.add_argument("--replay", type=Path)
    given = parser.parse_args()
    sys.stdout.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
    faults: Counter[str] = Counter()
    done: Counter[str] = Counter()
    if given.replay:
        return replay(given.replay)
    end = time.monotonic() + given.seconds
    with suppress(KeyboardInterrupt):  # what was done until then counts
        for name, batch in chosen_batches(given):
            if time.monotonic() > end:
                break
            run_batch(name, batch, faults, done, given.keep)
    print(f"{dict(done)} runs, {sum(faults.values())} faults of {len(faults)} kinds")  # noqa: T201
    return int(bool(faults))


def chosen_batches(given: argparse.Namespace) -> Iterator[tuple[str, dict[int, Job]]]:
    """Warm up, and return the batches that the command line asks for."""
    if given.options:
        warm(plain_jobs(given.families))
        return option_batches(given.families, given.seed, given.first, given.count)
    families = given.families or list(FAMILIES)
    for family in families:
        warm(sound_jobs(family))
    if given.sweep:
        return swept_batches(families, given.first, given.count)
    return batches(families, given.seed, given.first, given.count)


def warm(sound: Sequence[Job]) -> None:
    """Run each command line once in this process, so that its copies have all modules and kernels."""
    import contextlib
    import io
    import os
    import tempfile

    from cli import main as command

    warnings.simplefilter("ignore")
    here = Path.cwd()
    for job in sound:
        if job.line[:2] == ["simulate", "rigid"]:  # its engine has threads, which copies of a process lack
            importlib.import_module("rapier3d")
            continue
        with tempfile.TemporaryDirectory() as folder:
            for name, data in job.files.items():
                (Path(folder) / name).parent.mkdir(parents=True, exist_ok=True)
                (Path(folder) / name).write_bytes(data)
            os.chdir(folder)
            with contextlib.redirect_stderr(io.StringIO()), contextlib.redirect_stdout(io.TextIOWrapper(io.BytesIO())):
                is_layer = job.line[0] == usd_layers.NAME
                code = usd_layers.run(job.line) if is_layer else command.run(list(job.line))
            if code in (1, 3):  # others have reasons: a fixture without a skin
                raise SystemExit(f"{' '.join(job.line)} of a sound file: exit code {code}")
            os.chdir(here)


def batches(families: Sequence[str], seed: int, first: int, count: int) -> Iterator[tuple[str, dict[int, Job]]]:
    """Yield family and seed, and some of its jobs by number, in turn for all families."""
    for start in range(first, first + count, BATCH):
        numbers = range(start, start + BATCH)
        for family in families:
            yield f"{family} {seed}", dict(zip(numbers, jobs(family, seed, numbers), strict=True))


def swept_batches(families: Sequence[str], first: int, count: int) -> Iterator[tuple[str, dict[int, Job]]]:
    """Yield family and "sweep", and some of the jobs of its sweep by number."""
    for family in families:
        yield from numbered_batches(f"{family} sweep", sweep_jobs(family), first, count)


def option_batches(commands: Sequence[str], seed: int, first: int, count: int) -> Iterator[tuple[str, dict[int, Job]]]:
    """Yield "options" and seed, and some of the jobs of the commands' options by number."""
    return numbered_batches(f"options {seed}", option_jobs(commands, seed), first, count)


def numbered_batches(name: str, every: Iterable[Job], first: int, count: int) -> Iterator[tuple[str, dict[int, Job]]]:
    """Yield the name, and some of the jobs by number."""
    chosen = itertools.islice(enumerate(every), first, first + count)
    while batch := dict(itertools.islice(chosen, BATCH)):
        yield name, batch


def run_batch(name: str, batch: dict[int, Job], faults: Counter[str], done: Counter[str], keep: Path | None) -> None:
    """Run a batch and count its faults by kind."""
    for (number, job), outcome in zip(batch.items(), run_jobs(list(batch.values()), look), strict=True):
        done[name.split()[0]] += 1
        found = problems(job, outcome)
        if found:
            kind = kind_of(job, outcome, found)
            faults[kind] += 1
            if faults[kind] == 1:
                job = shorten(job, partial(has_kind, kind=kind)) if job.option else job
                print(f"{name} {number}: {shown(job.line)}: {kind}", flush=True)  # noqa: T201
                if keep is not None:
                    save(job, keep / f"{name.replace(' ', '-')}-{number}.json")


def has_kind(job: Job, kind: str) -> bool:
    """Return whether a job has a fault of this kind."""
    (outcome,) = run_jobs([job], look)
    return kind_of(job, outcome, problems(job, outcome)) == kind


def shown(line: Sequence[str]) -> str:
    """Return a command line for a shell; long repetitions are cut."""
    return re.sub(r"(.)\1{99,}", r"\1\1\1…", shlex.join(line))


def kind_of(job: Job, outcome: Outcome, found: list[str]) -> str:
    """Return what faults of one cause have in common: where a traceback ended, else the words without numbers."""
    places = re.findall(r'File ".*?/((?:anim|cli)/.*?)", line (\d+)', outcome.err)
    if places and "Traceback" in found:
        last = [each for each in outcome.err.splitlines() if re.match(r"\w[\w.]*(Error|Exception|Warning)", each)]
        return f"{':'.join(places[-1])} {last[-1][:100] if last else ''}"
    what = f"{job.line[0]} {job.option}".rstrip()
    return f"{what}: " + re.sub(r"\d+(\.\d+)?", "N", f"{'; '.join(found)}: {outcome.err[:150]}")


def replay(kept_at: Path) -> int:
    """Run the jobs that were kept in a folder, or the one in a file; return 1 if there is a fault."""
    kept = [load(path) for path in ([kept_at] if kept_at.is_file() else sorted(kept_at.glob("*.json")))]
    faults = 0
    for job, outcome in zip(kept, run_jobs(kept, look), strict=True):
        if found := problems(job, outcome):
            faults += 1
            print(f"{shown(job.line)}: {kind_of(job, outcome, found)}")  # noqa: T201
    return int(faults > 0)


def save(job: Job, path: Path) -> None:
    """Write a job as JSON, its files compressed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    files = {name: base64.b64encode(zlib.compress(data)).decode() for name, data in job.files.items()}
    path.write_text(json.dumps({"line": list(job.line), "files": files, "option": job.option}) + "\n")


def load(path: Path) -> Job:
    """Read a job from JSON."""
    content = json.loads(path.read_text())
    files = {name: zlib.decompress(base64.b64decode(data)) for name, data in content["files"].items()}
    return Job(content["line"], files, content.get("option", ""))


if __name__ == "__main__":
    sys.exit(main())
