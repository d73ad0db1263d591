"""Workflow of commands on many files: an output for each, by a pattern; a file that fails does not stop the others."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from anim.errors import AnimError
from anim.units import plural
from cli import errors
from cli.errors import NoFileError, RefusedOutputError, UsageError
from cli.io import command_files, documents, input_files, output_folders, output_names
from cli.text import Reporter
from cli.typer_options import name_options


class FilePair(NamedTuple):
    """Input and output of one file."""

    input: str
    output: str


def edit_named(
    input: str,
    output: str,
    more: Sequence[str],
    pattern: str | None,
    edit: Callable[[str, str], object],
    reporter: Reporter,
    *,
    dry_run: bool,
    check: Callable[[str], None] = documents.check_extension,
    placeholders: Sequence[str] = (),
) -> int:
    """Run `edit` on IN and OUT, or with a pattern of outputs on all named files; return the exit code.

    check: raises UsageError for the extension of an output. placeholders: that `edit` replaces in OUT.
    """
    if pattern is None:
        if more:
            help = "the command takes IN and OUT; for more inputs name their outputs by --out"
            raise UsageError(f"got unexpected extra argument ({more[0]})", help=help)
        refuse_folder(input, help="all its files: -o 'out/{path}'")
        with _advise_folder(input, output):
            if dry_run and output != documents.PIPE:  # here, since folders of --out are made when files are written
                check(output)
                documents.check_file(output, placeholders)
            edit(input, output)
        return errors.DONE
    if not pattern:
        raise UsageError("--out has an empty name")
    names = [input, *([] if output == documents.PIPE else [output]), *more]
    return edit_files(names, pattern, edit, reporter, dry_run=dry_run, check=check)


@contextmanager
def _advise_folder(input: str, output: str) -> Iterator[None]:
    """Advise --out in the error for an output that is a folder, or named as one; stdin has no name for a file in it."""
    try:
        yield
    except RefusedOutputError as error:
        if input != documents.PIPE and (os.path.isdir(output) or output.endswith(("/", os.sep))):
            folder = shlex.quote(f"{output.rstrip('/' + os.sep)}/")
            error.advise(f"for a file of the input's name in that folder: -o {folder}")
        raise


def refuse_folder(path: str, *, help: str) -> None:
    """Raise UsageError if the input is a folder."""
    if os.path.isdir(path):
        raise UsageError(f"{path}: is a folder (expected a file)", help=help)


def edit_files(
    inputs: Sequence[str],
    pattern: str,
    edit: Callable[[str, str], object],
    reporter: Reporter,
    *,
    dry_run: bool,
    check: Callable[[str], None] = documents.check_extension,
) -> int:
    """Run `edit` on each input and its output, in order; return the largest exit code.

    inputs: files, folders and patterns. pattern: name of an output with {path}, below the input's folder or the fixed
    part of its pattern, {folder}, {name} or {stem}; "out/" is "out/{path}". Errors are reported with the file's name.
    Raises UsageError, before any work, for two inputs with one output, or an output that is another input.
    """
    pairs = plan_files(inputs, f"{pattern}{{path}}" if pattern.endswith("/") else pattern, check)
    codes = []
    for pair in pairs:
        try:
            command_files.check_names({"OUT": pair.output}, [pair.input])
            with output_folders.make_folder(pair.output, needed=not dry_run):
                edit(pair.input, pair.output)
        except AnimError as error:
            if isinstance(error, UsageError) and not isinstance(error, RefusedOutputError):  # of the options
                raise
            name_options(error, {})
            codes.append(errors.report_error(error))
    if len(pairs) > 1:
        failed = f", {len(codes)} failed" if codes else ""
        reporter.info(f"{plural(len(pairs), 'file')}{failed}")
    return max(codes, default=errors.DONE)


def plan_files(
    inputs: Sequence[str], pattern: str, check: Callable[[str], None] = documents.check_extension
) -> list[FilePair]:
    """Return each input with its output. Files below the folder of the outputs, if a search finds them, are none."""
    output_names.check_placeholders(pattern, output_names.OF_PATHS)
    pairs: dict[str, FilePair] = {}
    found = [each for each in input_files.find(inputs) if not _is_output(each, pattern)]
    if not found:
        raise NoFileError("all files found are outputs", help=f"they are in the folder of '{pattern}'")
    for each in found:
        if each.path == documents.PIPE:
            raise UsageError("stdin has no name for --out: name files")
        pair = FilePair(each.path, output_names.fill_path(pattern, os.path.relpath(each.path, each.folder)))
        check(pair.output)
        same = pairs.setdefault(_key(pair.output), pair)
        if same is not pair:
            where = output_names.say_where_equal(same.output, pair.output)
            problem = f"'{same.input}' and '{pair.input}' have the same output{where}, '{pair.output}'"
            raise UsageError(problem, help="--out needs {path}, or {folder} with {name} or {stem}")
    _check_inputs(list(pairs.values()))
    return list(pairs.values())


def _check_inputs(pairs: Sequence[FilePair]) -> None:
    """Raise UsageError if an output would replace the input of another file."""
    inputs = {_key(pair.input): pair.input for pair in pairs}
    for pair in pairs:
        other = inputs.get(_key(pair.output), pair.input)
        if other != pair.input:
            raise UsageError(f"the output of '{pair.input}' would replace '{other}', which is an input too")


def _key(path: str) -> str:
    return output_names.name_key(os.path.realpath(path))


def _is_output(found: input_files.FoundFile, pattern: str) -> bool:
    """True for a file that a search found in the folder of the outputs, which is inside of the searched one."""
    folder = Path(os.path.abspath(output_names.fixed_folder(pattern)))
    searched = Path(os.path.abspath(found.folder))
    inside = folder != searched and folder.is_relative_to(searched)
    return found.is_searched and inside and Path(os.path.abspath(found.path)).is_relative_to(folder)
