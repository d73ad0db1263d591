"""Names are the field's terms, and docstrings begin with an imperative or a noun phrase: see CONTRIBUTING.md."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
MODULES = sorted(path for package in ("anim", "cli") for path in (ROOT / package).rglob("*.py"))

# Words that no module, public function, method, class or constant is named with, and the field's terms for them.
TERMS = {
    "aim aims": "compensation in world space",
    "beginning beginnings": "magic bytes",
    "bench": "trial runner",
    "bending": "second-derivative bound",
    "beside": "companion",
    "chained": "sequence",
    "crew": "thread pool, process pool",
    "doubled": "duplicate",
    "drift": "difference bound",
    "ending endings": "file extension",
    "fared stand standing standings": "score, ranking",
    "finished": "complete",
    "held": "constant; influences",
    "joined": "merge, concatenate",
    "judged": "evaluate, classify",
    "kept": "cached, retained",
    "laid": "layout",
    "law laws": "interpolation arc",
    "lever levers": "moment arm, orientation probe",
    "look looked looks": "sample, evaluate; options",
    "mend mended": "fix",
    "mirrored": "mirror (functions are verbs)",
    "miss missed off": "error, deviation",
    "narrow": "collapse index",
    "pace": "frame spacing",
    "piece pieces": "segment, chunk",
    "placed": "position, interval, offset",
    "room": "package; scratch buffer",
    "seal sealed": "fingerprint, marker",
    "setting settings": "context, options",
    "shifted": "shift (functions are verbs), offset",
    "site": "optimizer",
    "spelled": "text, format",
    "strain strains": "bound usage",
    "stray strays": "detached joints",
    "stretch stretched stretches": "time span; scale-shear",
    "tempo": "time mapping, speed",
    "thinned": "reduce (functions are verbs)",
    "told": "report",
    "truth": "source motion",
    "turn turned turns": "rotation, angle",
    "wanted": "target, requested",
    "way ways": "path, arc",
    "worlds": "world matrices",
    "wrapped": "wrap (functions are verbs)",
}
TERM = {word: term for words, term in TERMS.items() for word in words.split()}
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
    names = [(path, name) for path in MODULES for name in (path.stem, *_public_names(path))]
    found = [
        f"{_short(path)}: {name}: for '{word}' take: {TERM[word]}"
        for path, name in names
        for word in _words(name.rpartition(".")[2]) & TERM.keys()
    ]
    assert not found, "\n".join(found)


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
