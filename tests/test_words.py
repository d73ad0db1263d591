"""Names are the field's terms, and docstrings begin with an imperative or a noun phrase: see CONTRIBUTING.md."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
MODULES = sorted(path for package in ("anim", "cli") for path in (ROOT / package).rglob("*.py"))

# Words that no module, public function, method, class or constant is named with. The glossary has a term for each.
FORBIDDEN = frozenset(
    """
    aim aims beginning beginnings bench bending beside chained crew doubled drift ending endings fared finished held
    joined judged kept laid law laws lever levers look looked looks mend mended mirrored miss missed narrow off pace
    piece pieces placed room seal sealed setting settings shifted site spelled stand standing standings strain
    strains stray strays stretch stretched stretches tempo thinned told truth turned turns wanted way ways worlds
    wrapped
    """.split()  # noqa: SIM905 (one name per line would hide the words)
)
ADVICE = (  # modules that compose command lines, the advice of findings
    "anim/check/",
    "anim/gltf/reading/reader.py",
    "anim/measure/loops/recommendations.py",
    "anim/show/page/build/",  # options of npm and esbuild
    "anim/simulation/report.py",
    "anim/skinning/analysis/recommendations.py",
)
OPTION = re.compile(r"(?<![\w-])--[a-z]")
OPENINGS = re.compile(r"(what|how|which|whose|whether)\b", re.IGNORECASE)


def test_modules_are_found() -> None:
    assert len(MODULES) > 250
    assert "optimize" in {name for path in MODULES for name in _public_names(path)}


def test_no_public_name_has_a_forbidden_word() -> None:
    found = [(_short(path), path.stem) for path in MODULES if _words(path.stem) & FORBIDDEN]
    found += [
        (_short(path), name)
        for path in MODULES
        for name in _public_names(path)
        if _words(name.rpartition(".")[2]) & FORBIDDEN
    ]
    assert not found, "take the term from the glossary in CONTRIBUTING.md"


def test_words_are_split_as_names_are_written() -> None:
    assert _words("LoopGap") == {"loop", "gap"}
    assert _words("MAX_KEPT_TRACKS") == {"max", "kept", "tracks"}
    assert _words("_PNGStrays2") == {"png", "strays", "2"}


def test_no_docstring_opens_with_a_question_word() -> None:
    found = [(_short(path), line) for path in MODULES for line in _docstring_openings(path) if OPENINGS.match(line)]
    assert not found, "begin with an imperative or a noun phrase"


def test_the_library_names_no_option() -> None:
    """Errors and notes write parameters as `name`; the command line names the option for it."""
    found = [
        (_short(path), text)
        for path in MODULES
        if _short(path).startswith("anim/") and not _short(path).startswith(ADVICE)
        for text in _strings(path)
        if OPTION.search(text)
    ]
    assert not found, "write the parameter in backquotes"


def _public_names(path: Path) -> Iterator[str]:
    """Yield functions, classes, their methods, and constants of a module whose names begin with no underscore."""
    for node in _tree(path).body:
        for name in _defined(node):
            if not name.startswith("_"):
                yield name
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            methods = (each.name for each in node.body if isinstance(each, ast.FunctionDef))
            yield from (f"{node.name}.{name}" for name in methods if not name.startswith("_"))


def _defined(node: ast.stmt) -> list[str]:
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return [node.name]
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    return [target.id for target in targets if isinstance(target, ast.Name)]


def _docstring_openings(path: Path) -> Iterator[str]:
    """Yield the first line of every docstring of a module."""
    for node in ast.walk(_tree(path)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            yield (ast.get_docstring(node) or "\n").splitlines()[0]


def _strings(path: Path) -> Iterator[str]:
    """Yield the strings of a module that are no docstrings."""
    nodes = list(ast.walk(_tree(path)))
    blocks = [node for node in nodes if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and node.body]
    docstrings = {id(node.body[0].value) for node in blocks if isinstance(node.body[0], ast.Expr)}
    for node in nodes:
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docstrings:
            yield node.value


def _words(name: str) -> set[str]:
    return {word.lower() for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", name)}


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def _short(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()
