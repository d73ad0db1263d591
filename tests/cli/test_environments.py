"""The same bytes in every environment: locales, no terminal, no home, read-only folders, flags of Python."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.running import ENVIRONMENT, ROOT, TIMEOUT, built

LINES = (
    "resample walk.glb - --fps 5 -q",
    "convert walk.glb - -q",
    "inspect walk.glb --format json",
    "sample walk.glb --at 0",
    "loop walk.glb --format json",
)
ENVIRONMENTS: dict[str, dict[str, str | None]] = {
    "C": {"LC_ALL": "C", "LANG": "C"},
    "ASCII": {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
    "Latin-1": {"PYTHONIOENCODING": "latin-1"},
    "German": {"LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8"},
    "no home": {"HOME": None, "XDG_CACHE_HOME": None},
    "home that is not there": {"HOME": "/nonexistent"},
    "home without access": {"HOME": "/proc/1"},
    "narrow": {"COLUMNS": "1"},
    "columns of text": {"COLUMNS": "x"},
    "hash seed": {"PYTHONHASHSEED": "7"},
    "optimized": {"PYTHONOPTIMIZE": "2"},
    "warnings are errors": {"PYTHONWARNINGS": "error"},
    "development mode": {"PYTHONDEVMODE": "1"},
    "unbuffered": {"PYTHONUNBUFFERED": "1"},
    "many threads": {"OPENBLAS_NUM_THREADS": "8"},
    "no temporary folder": {"TMPDIR": "/nonexistent"},
    "dumb terminal": {"TERM": "dumb", "NO_COLOR": "1"},
}


def run(line: str, folder: Path, changes: dict[str, str | None]) -> tuple[int, bytes, bytes]:
    environment = {**ENVIRONMENT, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}
    environment |= {key: value for key, value in changes.items() if value is not None}
    environment = {key: value for key, value in environment.items() if changes.get(key, value) is not None}
    done = subprocess.run(
        [sys.executable, "-m", "anim", *line.split()],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        timeout=TIMEOUT,
        check=False,
    )
    return done.returncode, done.stdout, done.stderr


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("läuft here")
    (found / "walk.glb").write_bytes(built("biped"))
    return found


@pytest.fixture(scope="module")
def usual(folder: Path) -> dict[str, tuple[int, bytes, bytes]]:
    return {line: run(line, folder, {}) for line in LINES}


@pytest.mark.slow
@pytest.mark.parametrize("line", LINES)
@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_products_do_not_depend_on_the_environment(
    name: str, line: str, folder: Path, usual: dict[str, tuple[int, bytes, bytes]]
) -> None:
    assert usual[line][0] == 0
    assert run(line, folder, ENVIRONMENTS[name]) == usual[line]


@pytest.mark.skipif(sys.platform == "win32" or os.geteuid() == 0, reason="the system lets this user write anywhere")
def test_a_folder_that_is_read_only(tmp_path: Path) -> None:
    (tmp_path / "walk.glb").write_bytes(built("biped"))
    tmp_path.chmod(0o555)
    try:
        assert run("inspect walk.glb", tmp_path, {})[0] == 0
        code, _, err = run("convert walk.glb out.glb", tmp_path, {})
        assert (code, b"no permission" in err) == (3, True)
    finally:
        tmp_path.chmod(0o755)


@pytest.mark.slow
def test_a_plot_leaves_nothing_behind_where_the_home_can_not_be_written(folder: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    code, _, err = run(f"plot walk.glb {tmp_path / 'a.svg'} -q", folder, {"HOME": "/proc/1", "TMPDIR": str(tmp_path)})
    assert (code, err) == (0, b"")
    assert [path.name for path in tmp_path.iterdir()] == ["a.svg"]


@pytest.mark.slow
def test_variables_of_packages_are_not_asked(folder: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    wrong: dict[str, str | None] = {"MPLBACKEND": "x", "NUMBA_NUM_THREADS": "0", "SOURCE_DATE_EPOCH": "x"}
    assert run(f"plot walk.glb {tmp_path / 'a.svg'} -q", folder, wrong)[0] == 0
    assert run(f"bake walk.glb {tmp_path / 'a.usda'} --clip #0 --fps 4 -q", folder, wrong)[0] == 0
