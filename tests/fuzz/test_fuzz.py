"""Mutations of fixtures end well: no traceback, no exit code 2, no hang, no memory, no output that can't be read.

Absurd values of options do too, but with exit code 2 and not 3.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from random import Random

import pytest

from cli.command_table import COMMANDS
from cli.commands.simulate import KINDS
from tests.cli.running import ENVIRONMENT, ROOT
from tests.fuzz.execution import Job
from tests.fuzz.mutations import MUTATIONS, mutate
from tests.fuzz.options import plain_jobs, shorten, value_options

FOUND = Path(__file__).with_name("found")
COUNTS = {  # mutations; 10 to 30 s each
    "gltf": 1200,
    "euler": 6000,
    "cache": 2000,
    "usd": 60,
    "usd-layers": 1000,
    "springs": 800,
    "bodies": 800,
    "settings": 1600,
    "rigs": 80,
}
SAMPLES = {  # sound inputs of some formats
    ".json": b'{"a": [1, {"b": 2.5}]}',
    ".gltf": b'{"a": [1, {"b": 2.5}]}',
    ".jsonl": b'{"a": [1, {"b": 2.5}]}\n{"c": "d"}\n',
    ".toml": b'a = [1, {b = 2.5}]\n[c]\nd = "e"\n',
}

pytestmark = pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs fork and /proc")


def fuzz(*arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**ENVIRONMENT, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "tests.fuzz", *arguments]
    return subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.slow
@pytest.mark.parametrize("family", COUNTS)
def test_mutations_end_well(family: str) -> None:
    pytest.importorskip("pxr")
    pytest.importorskip("OpenEXR")
    pytest.importorskip("rapier3d")
    run = fuzz(family, "--count", str(COUNTS[family]), "--seed", "17")
    assert run.returncode == 0, run.stdout + run.stderr


@pytest.mark.parametrize(
    "arguments",
    [("trim", "retime", "diff", "--count", "60"), pytest.param(("--count", "1000"), marks=pytest.mark.slow)],
)
def test_absurd_values_of_options_end_well(arguments: tuple[str, ...]) -> None:
    pytest.importorskip("rapier3d")
    run = fuzz("--options", *arguments, "--seed", "17")
    assert run.returncode == 0, run.stdout + run.stderr
    assert sum(map(int, re.findall(r": (\d+)", run.stdout.splitlines()[-1].split("}")[0]))) == int(arguments[-1])


def test_a_command_without_options_to_sweep_is_refused() -> None:
    run = fuzz("--options", "trimm")
    assert (run.returncode, run.stderr.strip()) == (1, "no command line of 'trimm'")


@pytest.mark.slow
def test_the_options_of_every_command_are_swept() -> None:
    lines = [" ".join(job.line) for job in plain_jobs()]
    commands = [*(name for name in COMMANDS if name != "simulate"), *(f"simulate {kind}" for kind in KINDS)]
    assert [each for each in commands if not any(line.startswith(f"{each} ") for line in lines)] == []


def test_options_that_name_files_are_not_swept() -> None:
    found = value_options(["from-euler", "a.bvh", "out.glb"])
    assert {"--order", "--scale", "--memory-limit"} <= set(found)
    assert not {"--onto", "--alias", "--depfile", "--dry-run"} & set(found)
    assert "--attractor" in value_options(["simulate", "particles", "a.glb", "out.glb"])


def test_only_options_that_a_fault_needs_stay() -> None:
    job = Job(["bake", "a.glb", "a.npz", "--rigid", "--fps", "4", "--method", "dqs", "--to=nan"], {}, "--to")
    shorter = shorten(job, lambda each: "--fps" in each.line)
    assert shorter.line == ["bake", "a.glb", "a.npz", "--fps", "4", "--to=nan"]


@pytest.mark.slow
@pytest.mark.skipif(not FOUND.is_dir(), reason="nothing was found")
def test_inputs_that_were_found_end_well() -> None:
    run = fuzz("--replay", str(FOUND))
    assert run.returncode == 0, run.stdout + run.stderr


@pytest.mark.parametrize("ending", MUTATIONS)
def test_a_seed_gives_one_mutation(ending: str) -> None:
    data = SAMPLES.get(ending, b"v 1 2 3\nf 1 2 3\n")
    if ending in (".glb", ".npz"):
        pytest.skip("needs a file of this kind")
    found = [mutate(f"a{ending}", data, Random(seed)) for seed in range(50)]
    assert found == [mutate(f"a{ending}", data, Random(seed)) for seed in range(50)]
    assert len(set(found)) > 25
