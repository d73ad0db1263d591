"""Families of inputs: sound files, the command lines that take them, and the judgement of an outcome."""

from __future__ import annotations

import json
import re
import signal
import tempfile
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from pathlib import Path
from random import Random

import numpy as np

import fixtures
from anim.caches import registry
from anim.caches.options import ReadOptions
from anim.errors import AnimError
from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from cli import main
from cli.io.cache_folders import CacheFolder
from tests.fuzz import usd_layers
from tests.fuzz.execution import CPU_LIMIT_S, Job, Outcome
from tests.fuzz.mutations import mutate
from tests.fuzz.rigs import judgement
from tests.fuzz.rigs.judgement import judge, rig_job, warm_jobs
from tests.fuzz.seed import Seed
from tests.fuzz.settings_seeds import settings_seeds
from tests.fuzz.simulation_seeds import body_seeds, spring_seeds

MAX_LINE_LENGTH = 1100  # characters of stderr
MAX_PEAK_BYTES = 1_000_000_000
QUESTIONS = ("--", "the clip's end")  # an option has to say what the file leaves open, or does not suit it
LAYERS = "usd-layers"
RIGS = "rigs"  # the family of sound files, whose outputs are judged
SETTINGS = {"gltf-anim.toml", "pyproject.toml"}
CRASHES = (signal.SIGSEGV, signal.SIGABRT, signal.SIGFPE, signal.SIGILL, signal.SIGBUS)
CODES = (0, 3, 4, 5, 6)  # 2 is for command lines, and those here are sound
OPTION_CODES = (0, 2, 4, 5, 6)  # 3 is for files
CONTRADICTIONS = ("in the file (got", "which it moves itself")  # option and file are right, each by itself
NO_NUMBER = re.compile(r"(?<![\w'])-?(nan|inf)(?![\w'])")

GLTF_FIXTURES = ("arm", "morph_cube", "interpolations", "pointer", "gltf_embedded")
GLTF_LINES = (
    "inspect IN --format json",
    "check IN",
    "convert IN out.glb",
    "convert IN out.gltf",
    "sample IN --space world --fps 5",
    "resample IN out.glb --fps 5",
    "resample IN out.gltf --fps 5 --interpolation cubicspline",
    "ease IN out.glb --ease bounce-out",
    "spline IN out.glb",
    "retime IN out.glb --speed 2 --warp sine-in-out",
    "trim IN out.glb --from 0.1 --to 0.5",
    "loop IN --format json",
    "loop IN out.glb --blend 0.1",
    "to-euler IN out.bvh --clip #0",
    "to-euler IN out.json --clip #0",
    "bake IN {clip}.npz --fps 4",
    "bake IN {clip}.pc2 --fps 4 --method dqs --rigid",
    "bake IN {clip}.glb --fps 4 --normals --rigid",
    "plot IN out.svg --clip #0",
    "render IN out.png --frames 2 --clip #0",
    "collapse IN --format json",
    "diff IN IN --format json",
    "optimize IN out.glb --effort fast --jobs 1",
)
EULER_LINES = {
    ".bvh": ("from-euler IN out.glb", "from-euler IN out.gltf --onto onto.glb"),
    ".csv": ("from-euler IN out.glb --order XYZ --axes extrinsic --unit deg",),
    ".json": ("from-euler IN out.glb", "from-euler IN out.glb --onto onto.glb"),
}
CACHE_LINES = ("convert-cache IN out.npz", "convert-cache IN out.glb", "convert-cache IN out.mdd --up z")
CACHE_ENDINGS = (".npz", ".pc2", ".mdd", ".png", ".exr", ".ply", ".obj", ".stl", ".glb")
USD_ENDINGS = (".usda", ".usdc")


@cache
def seeds(family: str) -> tuple[Seed, ...]:
    """Return the sound inputs of a family."""
    return tuple(SEEDS[family]())


def jobs(family: str, seed: int, numbers: range) -> list[Job]:
    """Return the jobs of these numbers: always the same for a family and a seed."""
    if family == RIGS:
        return [rig_job(Random(f"{family} {seed} {number}")) for number in numbers]
    return [_job(family, Random(f"{family} {seed} {number}")) for number in numbers]


def _job(family: str, chosen: Random) -> Job:
    sound = chosen.choice(seeds(family))
    name = chosen.choice(sound.mutated)
    changed = mutate(name, sound.files[name], chosen)
    return Job(command_words(chosen.choice(sound.lines), sound.main), {**sound.files, name: changed})


def sound_jobs(family: str) -> list[Job]:
    """Return a job for each command line on a sound file; they must succeed, and compile all kernels."""
    if family == RIGS:
        return warm_jobs()
    return [Job(command_words(line, each.main), each.files) for each in seeds(family) for line in each.lines]


def command_words(line: str, name: str) -> list[str]:
    """Return the words of a command line on a file."""
    return [name if word == "IN" else word for word in line.split()]


def _gltf() -> Iterator[Seed]:
    for name in GLTF_FIXTURES:
        files = fixtures.build_files(name)
        yield Seed(next(iter(files)), files, list(files), GLTF_LINES)


def _euler() -> Iterator[Seed]:
    arm = fixtures.build("arm")
    for ending, lines in EULER_LINES.items():
        made = _made(
            f"to-euler arm.glb a{ending} --clip bend --fps 5" + " --order XYZ --axes extrinsic" * (ending == ".csv")
        )
        yield Seed(f"a{ending}", {**made, "onto.glb": arm}, list(made), lines)


def _caches() -> Iterator[Seed]:
    for ending in CACHE_ENDINGS:
        made = _made(f"bake arm.glb a{ending} --clip bend --fps 4")
        yield Seed(f"a{ending}", made, list(made), CACHE_LINES)


def _usd() -> Iterator[Seed]:
    """Caches apart from the others: each starts a process that loads usd-core, which takes 30 times as long."""
    for ending in USD_ENDINGS:
        made = _made(f"bake arm.glb a{ending} --clip bend --fps 4")
        yield Seed(f"a{ending}", made, list(made), CACHE_LINES)
        made = _made(f"convert arm.glb skinned{ending} --clip bend --fps 4")  # a skeleton, which usd-core evaluates
        yield Seed(f"skinned{ending}", made, list(made), CACHE_LINES)


def _usd_layers() -> Iterator[Seed]:
    """The same files, read in this process."""
    for each in _usd():
        yield Seed(each.main, each.files, each.mutated, [f"{usd_layers.NAME} IN"])


def _made(line: str) -> dict[str, bytes]:
    """Files that a command line makes of the fixture `arm`."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "arm.glb").write_bytes(fixtures.build("arm"))
        names = ("arm.glb", line.split()[2])
        words = [f"{folder}/{word}" if word in names else word for word in line.split()]
        assert main.run([*words, "-q"]) == 0, line
        return {path.name: path.read_bytes() for path in sorted(Path(folder).iterdir()) if path.name != "arm.glb"}


SEEDS: dict[str, Callable[[], Iterator[Seed]]] = {
    "gltf": _gltf,
    "euler": _euler,
    "cache": _caches,
    "usd": _usd,
    LAYERS: _usd_layers,
    "springs": spring_seeds,
    "bodies": body_seeds,
    "settings": settings_seeds,
}


FAMILIES = (*SEEDS, RIGS)


def problems(job: Job, outcome: Outcome) -> list[str]:
    """Return the faults of an outcome: what no input and no option may cause."""
    found = list(outcome.problems)
    if not _is_right_code(job, outcome):
        found.append(f"exit code {outcome.code}")
    if job.option and NO_NUMBER.search(outcome.err.replace(job.line[-1].partition("=")[2] or "=", "")):
        found.append("a message without a number")
    if outcome.cpu_s > CPU_LIMIT_S or outcome.code == -24:
        found.append(f"{outcome.cpu_s:.1f} s")
    if outcome.peak_bytes > MAX_PEAK_BYTES or "out of memory" in outcome.err:
        found.append(f"{outcome.peak_bytes / 1e6:.0f} MB")
    found += [word for word in ("Traceback", "Warning:", "Exception ignored") if word in outcome.err]
    if any(len(line) > MAX_LINE_LENGTH for line in outcome.err.splitlines()):
        found.append("a long message")
    return found


def _is_right_code(job: Job, outcome: Outcome) -> bool:
    """Return whether a job may end so. Wrong settings are wrong usage."""
    if job.option:
        return outcome.code in OPTION_CODES or any(words in outcome.err for words in CONTRADICTIONS)
    words_of_questions = QUESTIONS if not SETTINGS & set(job.files) else ("",)
    is_question = outcome.code == 2 and any(words in outcome.err for words in words_of_questions)
    is_crash = job.line[0] == usd_layers.NAME and -outcome.code in CRASHES  # of usd-core, in what is a child elsewhere
    return outcome.code in CODES or is_question or is_crash


def look(line: Sequence[str], code: int, names: Sequence[str], out: bytes, err: str) -> list[str]:
    """Return the faults of the outputs in the current folder: a file of a failed run, or one that can't be read."""
    written = [name for name in names if not name.startswith("{")]
    if judgement.NAME in line and code not in (0, 6):
        return [f"a sound rig is refused with {code}"]
    if code not in (0, 6):
        several = line[0] == "run" or any("{clip}" in word for word in line)  # those before stay, and a note tells so
        return [f"{name} is left" for name in written if not several]
    found = []
    for name in written:
        try:
            _read(name, is_copy=line[0] == "convert")
        except (AnimError, ValueError) as error:
            found.append(f"{name} can't be read: {error}"[:200])
    if out[:1] == b"{":
        try:
            json.loads(out, parse_constant=_refuse)
        except ValueError as error:
            found.append(f"stdout is no JSON: {error}"[:200])
    return found + (judge(line, err, out) if judgement.NAME in line else [])


def _refuse(name: str) -> float:
    raise ValueError(name)


def _read(name: str, *, is_copy: bool) -> None:
    ending = Path(name).suffix
    if ending in (".glb", ".gltf"):
        folder = Path()
        document = container.read(Path(name).read_bytes(), lambda each: np.fromfile(folder / each, np.uint8))
        if not is_copy:  # which `convert` does not look into
            reader.clips(document, Accessors(document))
    elif ending == ".json":
        json.loads(Path(name).read_bytes(), parse_constant=_refuse)
    elif ending in (".npz", ".pc2", ".mdd"):
        cache = registry.reader_for(ending)(CacheFolder(Path(), name), ReadOptions())
        for _ in cache.chunks():
            pass
