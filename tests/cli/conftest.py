"""Running the command line in this process, and the files that its tests take."""

from __future__ import annotations

import io
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import fixtures
from cli import main
from tests.cli.running import Run, built
from tests.textured import textured

Call = Callable[..., Run]
Find = Callable[[str], Path]  # `asset` and `bad_input` of tests/conftest.py
Fixture = Callable[[str], Path]


@pytest.fixture
def call(capsysbinary: pytest.CaptureFixture[bytes], monkeypatch: pytest.MonkeyPatch) -> Call:
    """Run one command line in this process: call("convert", path, "-", stdin=b"") → Run."""

    def called(*args: str | Path, stdin: bytes = b"") -> Run:
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(stdin)))
        capsysbinary.readouterr()
        code = main.run([str(arg) for arg in args])
        out, err = capsysbinary.readouterr()
        return Run(code, out, err.decode())

    return called


@pytest.fixture
def fixture(tmp_path: Path) -> Fixture:
    """Write a fixture with what lies beside it into the test's folder, and give its path."""

    def written(name: str) -> Path:
        files = fixtures.build_files(name)
        for file, data in files.items():
            (tmp_path / file).write_bytes(data)
        return tmp_path / next(iter(files))

    return written


@pytest.fixture
def noop() -> bytes:
    """The fixture with a clip for each thing that `inspect` finds fault with."""
    return built("noop")


@pytest.fixture
def biped() -> bytes:
    """The fixture of a walking figure."""
    return built("biped")


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    """The biped in the test's folder, as walk.glb."""
    path = tmp_path / "walk.glb"
    path.write_bytes(built("biped"))
    return path


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Three files: one with findings, one without, one that is not glTF."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "crowd").mkdir()
    (tmp_path / "noop.glb").write_bytes(built("noop"))
    (tmp_path / "crowd" / "arm 1.glb").write_bytes(built("arm"))
    return tmp_path


@pytest.fixture
def textured_path(tmp_path: Path) -> Path:
    """A skinned mesh with materials, images and everything that a bake must keep."""
    path = tmp_path / "textured.glb"
    path.write_bytes(textured())
    return path
