"""What is installed: the library, the command, and nothing else."""

from __future__ import annotations

import importlib
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


def test_the_project_names_two_packages() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    build = project["tool"]["hatch"]["build"]
    assert build["targets"] == {"wheel": {"packages": ["anim", "cli"]}}
    assert build["artifacts"] == ["anim/show/page/bundle/*"]
    assert project["project"]["scripts"] == {"gltf-anim": "cli.entry_point:main"}


def test_a_wheel_holds_two_packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("hatchling", reason="hatchling, which builds wheels, is not installed")
    monkeypatch.chdir(ROOT)
    name = importlib.import_module("hatchling.build").build_wheel(str(tmp_path))
    with zipfile.ZipFile(tmp_path / name) as wheel:
        files = {file for file in wheel.namelist() if ".dist-info/" not in file}
    assert {file.split("/")[0] for file in files} == {"anim", "cli"}
    assert {"anim/py.typed", "anim/__main__.py", "cli/main.py"} <= files
    sources = {path.relative_to(ROOT).as_posix() for room in ("anim", "cli") for path in (ROOT / room).rglob("*.py")}
    assert sources <= files
