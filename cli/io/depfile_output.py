"""The option --depfile: its file is made before OUT changes and renamed after it, so that both are there or neither."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from anim.files import atomic, guard
from cli.errors import UsageError
from cli.io import depfile, documents
from cli.io.command_files import CommandFiles


def check(path: str, output: str) -> None:
    """Raise UsageError or OutputError, before any work, if a dependency file can't be written to `path`.

    output: OUT, or "".
    """
    if output in ("", documents.PIPE):
        raise UsageError("--depfile needs an output file: name OUT")
    if path == documents.PIPE:
        raise UsageError("--depfile is '-' (expected a file name)", help="/dev/stdout writes the rule to stdout")
    documents.check_file(path)


def invoke(command: Callable[[], Any], path: str, output: str, files: CommandFiles, *, dry_run: bool) -> Any:
    """Run a command, and write the dependency file at `path` if it succeeds; return its exit code.

    Several files of one OUT (`{clip}.npz`) are replaced one by one, and the dependency file after them.
    files: of the command.
    """
    several = "{" in output
    made: list[tuple[str, Callable[[], None]]] = []  # the rule, and what renames its file
    guard.plan(Path(path))
    with ExitStack() as stack:

        def make() -> None:
            text = _rule(output, files)
            pieces = [np.frombuffer(documents.encode(text), np.uint8)]
            made.append((text, stack.enter_context(atomic.stage(Path(path), pieces))))

        files.before_change = None if several else make
        code = command()
        files.before_change = None
        with guard.use(None):  # which knows the file
            if not code and not dry_run:
                text = _rule(output, files)
                if made and made[0][0] == text:
                    made[0][1]()
                else:
                    documents.write_text(text, path)
    return code


def _rule(output: str, files: CommandFiles) -> str:
    outputs = list(files.outputs.values()) if "{" in output else [files.outputs.get(output, output)]
    inputs = list(files.inputs)
    for name in (*outputs, output, *inputs):
        for character, words in depfile.UNESCAPABLE.items():
            if character in name:
                raise UsageError(f"{name!r}: a rule of --depfile can't hold a name with {words}")
    return depfile.rule(outputs or [output], inputs)
