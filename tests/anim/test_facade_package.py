"""`import anim`: what is loaded, named and shown before anything is used."""

from __future__ import annotations

import inspect
import pydoc
import subprocess
import sys
from pathlib import Path

import pytest

import anim

ROOT = Path(__file__).resolve().parents[2]
MAX_MAP_LINES = 60


def test_import_loads_nothing_until_it_is_used() -> None:
    script = "import anim, sys; dir(anim); print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    loaded = set(run.stdout.split())
    assert {name for name in loaded if name.startswith("anim")} == {"anim"}
    assert not loaded & {"numpy", "scipy", "typer", "cli", "asyncio", "inspect"}


def test_every_name_is_there_and_on_the_map() -> None:
    text = inspect.getdoc(anim) or ""
    assert len(text.splitlines()) <= MAX_MAP_LINES
    for name in anim.__all__:
        assert getattr(anim, name) is not None
        assert name in text or name in ("BakedCache", "OptimizeResult", "Interpolation")
    assert set(anim.__all__) <= set(dir(anim))
    assert "anim.load(" in pydoc.plain(pydoc.render_doc(anim))
    with pytest.raises(AttributeError, match="'lode'"):
        anim.lode  # noqa: B018


def test_the_hints_for_type_checkers_name_the_same() -> None:
    lines = [line.split() for line in inspect.getsource(anim).splitlines() if line.startswith("    from anim")]
    assert {line[-1]: line[1] for line in lines if line[-1] != "ops"} == anim._HOMES
    assert (ROOT / "anim" / "py.typed").is_file()


def test_functions_keep_their_names_when_rooms_are_imported() -> None:
    """A room of the same name would take the place of a function when it is first imported."""
    rooms = {path.name for path in (ROOT / "anim").iterdir() if path.is_dir()}
    assert not rooms & set(anim.__all__)
    assert {path.stem for path in (ROOT / "anim").glob("*.py")} & set(anim.__all__) == {"ops"}


def test_the_module_runs_the_command() -> None:
    run = subprocess.run([sys.executable, "-m", "anim", "--version"], cwd=ROOT, capture_output=True, text=True)
    assert (run.returncode, run.stderr) == (0, "")
    assert anim.__version__ in run.stdout
