"""Mutations of fixtures end well: no traceback, no exit code 2, no hang, no memory, no output that can't be read."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from random import Random

import pytest

from tests.cli.running import ENVIRONMENT, ROOT
from tests.fuzz.mutations import MUTATIONS, mutate

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
