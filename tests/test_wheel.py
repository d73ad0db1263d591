"""What is installed: the library, the command, and nothing else."""

from __future__ import annotations

import configparser
import importlib
import os
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


def test_the_project_names_two_packages_and_an_entry_point() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    build = project["tool"]["hatch"]["build"]
    assert build["targets"] == {"wheel": {"only-include": ["anim", "cli", "gltf_anim.py"]}}
    assert build["artifacts"] == ["anim/show/page/bundle/*"]
    assert project["project"]["scripts"] == {"gltf-anim": "gltf_anim:main"}


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder into which a wheel is unpacked."""
    pytest.importorskip("hatchling", reason="hatchling, which builds wheels, is not installed")
    folder = tmp_path_factory.mktemp("wheel")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        name = importlib.import_module("hatchling.build").build_wheel(str(folder))
    with zipfile.ZipFile(folder / name) as wheel:
        wheel.extractall(folder / "site")
    return folder / "site"


def test_a_wheel_holds_two_packages_and_an_entry_point(installed: Path) -> None:
    names = {path.relative_to(installed).as_posix() for path in installed.rglob("*") if path.is_file()}
    files = {name for name in names if ".dist-info/" not in name}
    assert {file.split("/")[0] for file in files} == {"anim", "cli", "gltf_anim.py"}
    assert {"anim/py.typed", "anim/__main__.py", "cli/main.py"} <= files
    sources = {path.relative_to(ROOT).as_posix() for room in ("anim", "cli") for path in (ROOT / room).rglob("*.py")}
    assert sources <= files


FOREIGN = ("cli.py", "anim.py", "anim/__init__.py", "cli/__init__.py", "numpy.py", "typer.py", "json.py")


def run_among(files: tuple[str, ...], command: list[str], folder: Path, *search: Path) -> str:
    """Run a command in a folder of foreign modules, each of which would end it with another exit code."""
    for file in files:
        (folder / file).parent.mkdir(exist_ok=True)
        (folder / file).write_text("raise SystemExit(77)\n")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, search))}
    run = subprocess.run([sys.executable, *command], cwd=folder, env=environment, capture_output=True, check=False)
    assert run.returncode == 0, run.stderr
    return run.stdout.decode()


@pytest.mark.parametrize("foreign", [FOREIGN[:2], FOREIGN[2:4]], ids=["modules", "packages"])
def test_foreign_packages_of_the_same_names_are_not_run(
    foreign: tuple[str, ...], installed: Path, tmp_path: Path
) -> None:
    """They are first on the path; the script is the one that installers write."""
    (scripts,) = installed.glob("*.dist-info/entry_points.txt")
    parser = configparser.ConfigParser()
    parser.read_string(scripts.read_text())
    module, function = parser["console_scripts"]["gltf-anim"].split(":")
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "gltf-anim").write_text(f"from {module} import {function}\n{function}()\n")
    folder = tmp_path / "project"
    folder.mkdir()
    (folder / "a.gltf").write_text('{"asset": {"version": "2.0"}}')
    line = [str(tmp_path / "bin" / "gltf-anim"), "inspect", "a.gltf", "--format", "json"]
    assert "a.gltf" in run_among(foreign, line, folder, Path(), folder, installed)


@pytest.mark.parametrize("word", ["script", "module"])
def test_modules_in_the_current_folder_are_not_run(word: str, installed: Path, tmp_path: Path) -> None:
    """Also by `python -m`, which puts that folder first; a foreign `anim` would be what it is asked for."""
    command = ["-m", "anim"] if word == "module" else ["-c", SCRIPT]
    foreign = tuple(each for each in FOREIGN if word == "script" or not each.startswith("anim"))
    (tmp_path / "a.gltf").write_text('{"asset": {"version": "2.0"}}')
    assert "a.gltf" in run_among(foreign, [*command, "inspect", "a.gltf", "--format", "json"], tmp_path, installed)


# As a script, which has its own folder first on the path: here none.
SCRIPT = "import sys; del sys.path[0]; from gltf_anim import main; main()"
