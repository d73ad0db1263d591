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


def test_the_project_names_two_packages() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    build = project["tool"]["hatch"]["build"]
    assert build["targets"] == {"wheel": {"packages": ["anim", "cli"]}}
    assert build["artifacts"] == ["anim/show/page/bundle/*"]
    assert project["project"]["scripts"] == {"gltf-anim": "anim.__main__:main"}


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


def test_a_wheel_holds_two_packages(installed: Path) -> None:
    names = {path.relative_to(installed).as_posix() for path in installed.rglob("*") if path.is_file()}
    files = {name for name in names if ".dist-info/" not in name}
    assert {file.split("/")[0] for file in files} == {"anim", "cli"}
    assert {"anim/py.typed", "anim/__main__.py", "cli/main.py"} <= files
    sources = {path.relative_to(ROOT).as_posix() for room in ("anim", "cli") for path in (ROOT / room).rglob("*.py")}
    assert sources <= files


FOREIGN = ("cli.py", "anim.py", "numpy.py", "typer.py", "json.py")
OWN_CLI = [("cli.py",), ("cli/__init__.py",)]


def run_among(files: tuple[str, ...], command: list[str], folder: Path, *search: Path) -> str:
    """Run a command in a folder of foreign modules, each of which would end it with another exit code."""
    folder.mkdir()
    (folder / "a.gltf").write_text('{"asset": {"version": "2.0"}}')
    for file in files:
        (folder / file).parent.mkdir(exist_ok=True)
        (folder / file).write_text("raise SystemExit(77)\n")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, search))}
    words = [sys.executable, *command, "inspect", "a.gltf", "--format", "json"]
    run = subprocess.run(words, cwd=folder, env=environment, capture_output=True, check=False)
    assert run.returncode == 0, run.stderr
    return run.stdout.decode()


@pytest.fixture(scope="module")
def script(installed: Path) -> str:
    """The path of the script that installers write."""
    (points,) = installed.glob("*.dist-info/entry_points.txt")
    parser = configparser.ConfigParser()
    parser.read_string(points.read_text())
    module, function = parser["console_scripts"]["gltf-anim"].split(":")
    path = installed.parent / "bin" / "gltf-anim"
    path.parent.mkdir()
    path.write_text(f"from {module} import {function}\n{function}()\n")
    return str(path)


@pytest.mark.parametrize("foreign", OWN_CLI, ids=["module", "package"])
def test_a_foreign_cli_that_is_first_on_the_path_is_not_run(
    foreign: tuple[str, ...], script: str, installed: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "project"
    assert "a.gltf" in run_among(foreign, [script], folder, Path(), folder, installed)


@pytest.mark.parametrize("foreign", OWN_CLI, ids=["module", "package"])
def test_a_foreign_cli_in_the_current_folder_is_not_run(
    foreign: tuple[str, ...], installed: Path, tmp_path: Path
) -> None:
    """`python -m` puts that folder first."""
    assert "a.gltf" in run_among(foreign, ["-m", "anim"], tmp_path / "project", installed)


def test_the_command_runs_no_module_of_the_current_folder(script: str, installed: Path, tmp_path: Path) -> None:
    assert "a.gltf" in run_among(FOREIGN, [script], tmp_path / "project", installed)


def test_an_isolated_interpreter_runs_no_foreign_anim(tmp_path: Path) -> None:
    if subprocess.run([sys.executable, "-I", "-c", "import anim"], capture_output=True, check=False).returncode:
        pytest.skip("the project is not installed, only on the path")
    folder = tmp_path / "project"
    assert "a.gltf" in run_among(("anim/__init__.py", *FOREIGN), ["-I", "-m", "anim"], folder, folder)
