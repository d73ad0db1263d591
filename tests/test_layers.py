"""Imports point one way, and only the command line talks to the outside."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

# Rooms from the bottom up; a room may import from its own level only where NEIGHBORS says so.
LEVELS = (
    {"errors"},
    {"arrays", "units"},
    {"maths", "files"},
    {"model"},
    {"gltf", "sampling"},
    {"curves"},
    {"measure"},
    {"operations", "exchange", "skinning", "simulation", "caches", "optimization"},
    {"show"},
    {"ops", "clip_list"},  # the facade, which `anim` offers as its own
    {"asset"},
    {"api"},
)
NEIGHBORS = {("caches", "skinning"), ("optimization", "skinning"), ("simulation", "skinning")}
LEVEL = {room: level for level, rooms in enumerate(LEVELS) for room in rooms}

MODULES = sorted(path for path in (ROOT / "anim").rglob("*.py") if path.name != "__main__.py")  # which runs the command
COMMANDS = sorted((ROOT / "cli").rglob("*.py"))
KERNELS = [path for path in MODULES if path.parent.name == "kernels" and path.stem not in ("__init__", "layout")]
TERMINAL = {"typer", "click", "rich", "argparse"}
OPENING = {  # modules of the library that may open a path
    "anim/asset.py",
    "anim/caches/cache_file.py",
    "anim/files/atomic.py",
    "anim/files/links.py",
    "anim/files/resolver.py",
    "anim/gltf/io/gltf_files.py",
    "anim/gltf/io/images.py",
    "anim/gltf/io/source.py",
    "anim/gltf/io/unused_buffers.py",
    "anim/caches/temporary_files.py",  # for libraries that take names only
    "anim/skinning/kernels/jit.py",  # where compiled kernels are kept
}
LAZY = {"scipy", "trimesh", "meshopt", "pygltflib", "numba", "llvmlite", "matplotlib", "PIL", "png"}
LAZY |= {"mujoco", "pxr", "dask"}


def test_there_is_something_to_look_at() -> None:
    assert len(MODULES) > 30
    assert len(COMMANDS) > 5


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_a_module_imports_only_from_below(path: Path) -> None:
    room = _room(path)
    for name in _imported(path):
        parts = name.split(".")
        assert parts[0] not in {"cli", "fixtures", "tests"}, name
        if parts[0] != "anim" or len(parts) == 1 or room is None:
            continue
        other = parts[1]
        assert other in LEVEL, f"{name}: a room that the design doesn't know"
        assert other == room or LEVEL[other] < LEVEL[room] or (room, other) in NEIGHBORS, name


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_the_library_neither_prints_nor_opens_files(path: Path) -> None:
    assert not {name.split(".")[0] for name in _imported(path)} & TERMINAL
    if path.relative_to(ROOT).as_posix() not in OPENING:
        assert not _imported(path) & {"pathlib.Path", "pathlib", "mmap"}, "paths are opened elsewhere"
    for node in ast.walk(_tree(path)):
        if isinstance(node, ast.Call):
            assert ast.unparse(node.func) not in {"print", "open", "input", "exit", "sys.exit"}, node.lineno
        if isinstance(node, ast.Attribute):
            assert node.attr not in {"read_bytes", "write_bytes", "read_text", "write_text"}, node.lineno
            assert ast.unparse(node) not in {"sys.stdout", "sys.stderr", "sys.stdin", "sys.argv", "os.environ"}
            assert ast.unparse(node) not in {"time.time", "np.random.seed", "np.fromfile", "np.load", "np.memmap"}


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_no_circles(path: Path) -> None:
    seen: set[Path] = set()
    waiting = [path]
    while waiting:
        for other in _modules_of(waiting.pop()):
            assert other != path, f"{path.name} comes back to itself"
            if other not in seen:
                seen.add(other)
                waiting.append(other)


@pytest.mark.parametrize("path", COMMANDS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_the_command_line_imports_the_library_only(path: Path) -> None:
    for name in _imported(path):
        assert name.split(".")[0] not in {"fixtures", "tests", "click", "pygltflib", "scipy", "trimesh"}, name


@pytest.mark.parametrize("path", [*MODULES, *COMMANDS], ids=lambda path: path.relative_to(ROOT).as_posix())
def test_heavy_packages_are_imported_late(path: Path) -> None:
    """Kernels load numba, and are themselves imported late."""
    names = {name for node in _tree(path).body for name in _names(node)}
    if path in KERNELS:
        assert not {name.split(".")[0] for name in names} & (LAZY - {"numba"})
    else:
        assert not {name.split(".")[0] for name in names} & LAZY
        assert not [name for name in names if name.startswith(tuple(map(_dotted, KERNELS)))]


def test_importing_the_library_loads_nothing_heavy() -> None:
    names = [_dotted(path) for path in MODULES if path not in KERNELS]
    script = f"import sys, importlib\nfor name in {names!r}: importlib.import_module(name)\nprint(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert not set(run.stdout.split()) & (LAZY | TERMINAL)


def _room(path: Path) -> str | None:
    """The room of a module, None for the package itself."""
    parts = path.relative_to(ROOT / "anim").with_suffix("").parts
    return None if parts[0] == "__init__" else parts[0]


def _dotted(path: Path) -> str:
    name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    return name.removesuffix(".__init__")


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def _imported(path: Path) -> frozenset[str]:
    return frozenset(name for node in ast.walk(_tree(path)) for name in _names(node))


def _names(node: ast.AST) -> list[str]:
    """What an import statement names: "anim.gltf" and "anim.gltf.reading.reader" for `from anim.gltf import read`."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom):
        assert node.level == 0, "imports are absolute"
        return [f"{node.module}.{alias.name}" for alias in node.names]
    return []


@cache
def _modules_of(path: Path) -> frozenset[Path]:
    """Modules of the library that one imports when it runs: the packages on the way are only names."""
    names = {name for name in _imported(path) - set(_only_for_types(path)) if name.startswith("anim.")}
    both = names | {name.rpartition(".")[0] for name in names}  # `from anim.arrays import Floats` names a module's part
    files = {ROOT / (name.replace(".", "/") + ".py") for name in both}
    return frozenset(file for file in files if file.is_file())


def _only_for_types(path: Path) -> Iterator[str]:
    for node in _tree(path).body:
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            yield from (name for statement in node.body for name in _names(statement))
