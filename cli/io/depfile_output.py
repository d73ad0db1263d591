"""The option --depfile: its file is made before OUT changes and renamed after it, so that both are there or neither."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from anim.files import atomic
from anim.files.before_commit import before_commit
from cli.errors import UsageError
from cli.io import depfile, documents


def check(path: str, output: str, values: Iterable[Any]) -> None:
    """Raise UsageError or OutputError, before any work, if a dependency file can't be written to `path`.

    output: OUT, or "". values: of all arguments and options, which may name files.
    """
    if output in ("", documents.PIPE):
        raise UsageError("--depfile needs an output file: name OUT")
    if path == documents.PIPE:
        raise UsageError("--depfile is '-' (expected a file name)", help="/dev/stdout writes the rule to stdout")
    documents.check_file(path)
    if _is_same(path, output) or (output.endswith(".gltf") and _is_same(path, output[: -len("gltf")] + "bin")):
        raise UsageError(f"{path}: --depfile would replace OUT (expected another file)")
    for value in values:
        _refuse_inputs(path, [value] if isinstance(value, str) else value if isinstance(value, list | tuple) else ())


def invoke(command: Callable[[], Any], path: str, output: str, *, dry_run: bool) -> Any:
    """Run a command, and write the dependency file at `path` if it succeeds; return its exit code.

    Several files of one OUT (`{clip}.npz`) are replaced one by one, and the dependency file after them.
    """
    several = "{" in output
    made: list[tuple[str, Callable[[], None]]] = []  # the rule, and what renames its file
    with depfile.record_files() as record, ExitStack() as stack:

        def make() -> None:
            text = _rule(path, output, record)
            pieces = [np.frombuffer(documents.encode(text), np.uint8)]
            made.append((text, stack.enter_context(atomic.stage(Path(path), pieces))))

        with ExitStack() if several else before_commit(make):
            code = command()
        if not code and not dry_run:
            text = _rule(path, output, record)
            if made and made[0][0] == text:
                made[0][1]()
            else:
                documents.write_text(text, path)
    return code


def _rule(path: str, output: str, record: depfile.FileRecord) -> str:
    _refuse_inputs(path, record.inputs)
    outputs = list(record.outputs.values()) if "{" in output else [record.outputs.get(output, output)]
    inputs = list(record.inputs)
    for name in (*outputs, output, *inputs):
        for character, words in depfile.UNESCAPABLE.items():
            if character in name:
                raise UsageError(f"{name!r}: a rule of --depfile can't hold a name with {words}")
    return depfile.rule(outputs or [output], inputs)


def _refuse_inputs(path: str, names: Iterable[Any]) -> None:
    if any(isinstance(each, str) and _is_same(path, each) for each in names):
        raise UsageError(f"{path}: --depfile would replace an input (expected another file)")


def _is_same(path: str, other: str) -> bool:
    return os.path.realpath(path) == os.path.realpath(other)
