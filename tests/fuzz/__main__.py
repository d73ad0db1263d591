"""python -m tests.fuzz [FAMILY ...] [--count N] [--seed S] [--seconds T] [--sweep] [--keep FOLDER]: fuzz the commands.

Families: gltf, euler, cache, usd, usd-layers, springs, bodies, settings, and rigs, whose outputs are judged; all if
none is given. Runs mutations of fixtures until N of each family are done, or T seconds have passed; prints each new
kind of fault, and keeps its input in FOLDER, as one JSON file. With --sweep the mutations are not random: every value
of every JSON is replaced by each of a list. Such a file in tests/fuzz/found is a test from then on.
"""

from __future__ import annotations

import argparse
import base64
import importlib
import itertools
import json
import re
import sys
import time
import warnings
import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from tests.fuzz import usd_layers
from tests.fuzz.execution import BATCH, Job, Outcome, run_jobs
from tests.fuzz.families import FAMILIES, jobs, look, problems, sound_jobs
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
    parser.add_argument("--replay", type=Path)
    given = parser.parse_args()
    faults: Counter[str] = Counter()
    done: Counter[str] = Counter()
    if given.replay:
        return replay(given.replay)
    families = given.families or list(FAMILIES)
    for family in families:
        warm(family)
    end = time.monotonic() + given.seconds
    count = given.count
    for name, batch in (
        swept_batches(families, given.first, count)
        if given.sweep
        else batches(families, given.seed, given.first, count)
    ):
        if time.monotonic() > end:
            break
        run_batch(name, batch, faults, done, given.keep)
    print(f"{dict(done)} runs, {sum(faults.values())} faults of {len(faults)} kinds")  # noqa: T201
    return int(bool(faults))


def warm(family: str) -> None:
    """Run each command line once in this process, so that its copies have all modules and kernels."""
    import contextlib
    import io
    import os
    import tempfile

    from cli import main as command

    warnings.simplefilter("ignore")
    here = Path.cwd()
    for job in sound_jobs(family):
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
        every = itertools.islice(enumerate(sweep_jobs(family)), first, first + count)
        while batch := dict(itertools.islice(every, BATCH)):
            yield f"{family} sweep", batch


def run_batch(name: str, batch: dict[int, Job], faults: Counter[str], done: Counter[str], keep: Path | None) -> None:
    """Run a batch and count its faults by kind."""
    for (number, job), outcome in zip(batch.items(), run_jobs(list(batch.values()), look), strict=True):
        done[name.split()[0]] += 1
        found = problems(job, outcome)
        if found:
            kind = kind_of(job, outcome, found)
            faults[kind] += 1
            if faults[kind] == 1:
                print(f"{name} {number}: {' '.join(job.line)}: {kind}", flush=True)  # noqa: T201
                if keep is not None:
                    save(job, keep / f"{name.replace(' ', '-')}-{number}.json")


def kind_of(job: Job, outcome: Outcome, found: list[str]) -> str:
    """Return what faults of one cause have in common: where a traceback ended, else the words without numbers."""
    places = re.findall(r'File ".*?/((?:anim|cli)/.*?)", line (\d+)', outcome.err)
    if places and "Traceback" in found:
        last = [each for each in outcome.err.splitlines() if re.match(r"\w[\w.]*(Error|Exception|Warning)", each)]
        return f"{':'.join(places[-1])} {last[-1][:100] if last else ''}"
    return f"{job.line[0]}: " + re.sub(r"\d+(\.\d+)?", "N", f"{'; '.join(found)}: {outcome.err[:150]}")


def replay(kept_at: Path) -> int:
    """Run the jobs that were kept in a folder, or the one in a file; return 1 if there is a fault."""
    kept = [load(path) for path in ([kept_at] if kept_at.is_file() else sorted(kept_at.glob("*.json")))]
    faults = 0
    for job, outcome in zip(kept, run_jobs(kept, look), strict=True):
        if found := problems(job, outcome):
            faults += 1
            print(f"{' '.join(job.line)}: {kind_of(job, outcome, found)}")  # noqa: T201
    return int(faults > 0)


def save(job: Job, path: Path) -> None:
    """Write a job as JSON, its files compressed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    files = {name: base64.b64encode(zlib.compress(data)).decode() for name, data in job.files.items()}
    path.write_text(json.dumps({"line": list(job.line), "files": files}) + "\n")


def load(path: Path) -> Job:
    """Read a job from JSON."""
    content = json.loads(path.read_text())
    return Job(
        content["line"], {name: zlib.decompress(base64.b64decode(data)) for name, data in content["files"].items()}
    )


if __name__ == "__main__":
    sys.exit(main())
