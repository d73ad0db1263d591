"""Sound settings, recipes, baselines, and the files that `run` keeps: its journal, records and list of outputs."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import chdir
from pathlib import Path

import fixtures
from cli import main
from tests.fuzz.seed import Seed

SETTINGS = """\
[check]
select = ["GA1", "GA2"]
extend-select = ["GA301"]
ignore = ["GA103"]
fail-on = "error"
params = {"GA109.regular" = 0.5, "GA119.targets" = 4}
[[check.files]]
match = "*.glb"
ignore = ["GA111"]
[[budget]]
match = "a.glb"
keys = 900
"""
RECIPES = """\
[[recipe]]
name = "small"
match = "*.glb"
steps = ["resample --fps 10", "optimize --max-error 0.5mm --effort fast"]
out = "build/{name}"
[[recipe]]
match = "a.glb"
steps = ["retime --speed 2"]
out = "build/{folder}/{path}"
"""
PROJECT = "[project]\nname = 'x'\n" + SETTINGS.replace("[check", "[tool.gltf-anim.check").replace(
    "[[budget", "[[tool.gltf-anim.budget"
)
CHECK_LINES = ("check a.glb", "check a.glb --format json", "check . --config gltf-anim.toml --fail-on info")
RUN_LINES = (
    "run -j 1 --no-cache",
    "run -j 1",
    "run -j 1 --check a.glb",
    "run --emit make",
    "run --emit ninja --recipe small",
    "run --emit shell",
)
STATE_LINES = ("run -j 1 --resume", "run -j 1", "run -j 1 --delete-stale --cache-size 1kB")


def settings_seeds() -> Iterator[Seed]:
    """Yield settings of `check` and `run`, the state of a run before, and a baseline."""
    model = {"a.glb": fixtures.build("morph_cube")}
    yield Seed("gltf-anim.toml", {**model, "gltf-anim.toml": SETTINGS.encode()}, ["gltf-anim.toml"], CHECK_LINES)
    yield Seed("pyproject.toml", {**model, "pyproject.toml": PROJECT.encode()}, ["pyproject.toml"], CHECK_LINES[:2])
    recipes = {**model, "gltf-anim.toml": RECIPES.encode()}
    yield Seed("gltf-anim.toml", recipes, ["gltf-anim.toml"], RUN_LINES)
    kept = _made(recipes, "run -j 1")
    state = [name for name in kept if name.endswith((".json", ".jsonl"))]
    yield Seed("gltf-anim.toml", kept, state, STATE_LINES)
    known = _made(model, "check . --write-baseline known.json --fail-on info")
    line = "check . --baseline known.json --fail-on info"
    yield Seed("known.json", known, ["known.json"], (line, f"{line} --format json"))


def _made(files: dict[str, bytes], line: str) -> dict[str, bytes]:
    """All files of a folder after a command."""
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        for name, data in files.items():
            Path(name).write_bytes(data)
        assert main.run([*line.split(), "-q"]) in (0, 6), line
        paths = sorted(path for path in Path().rglob("*") if path.is_file())
        return {str(path): path.read_bytes() for path in paths}
