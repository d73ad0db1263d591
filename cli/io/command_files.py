"""Files of one command: those that it reads, and its outputs with all that is written beside them.

They are compared by real path, before the first of them is replaced, so that no output takes the place of another one,
of an input, of an input's buffers and images, or of a file of options.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path, PurePath
from typing import Any, NamedTuple

from anim.files import guard
from anim.files.special_files import descriptor_of, is_device_or_pipe
from cli.errors import RefusedOutputError, UsageError

PIPE = "-"


class _Input(NamedTuple):
    """name: as the command has it. mains: the files that it belongs to, by real path; itself for one of its own."""

    name: str
    mains: set[str]


class CommandFiles:
    """Files that a command reads and writes, by the names that it uses for them; what `guard` asks.

    before_change: called once, before any file is replaced, written directly, or given another time.
    copies: images that were copied beside outputs, to places without such a file.
    """

    def __init__(self) -> None:
        self.inputs: dict[str, None] = {}  # in order
        self.outputs: dict[str, str] = {}  # files of rules, by the names of outputs
        self.before_change: Callable[[], object] | None = None
        self.copies: list[Path] = []
        self._read: dict[str, _Input] = {}  # by place, and by the real path behind links
        self._replaced: dict[str, bool] = {}  # by place: whether it may be an input
        self._new: set[str] = set()

    def add_inputs(self, main: Path, paths: Iterable[Path]) -> None:
        """Add files that are read, which belong to `main`. Raises UsageError for one that is an output."""
        owner = os.path.realpath(main)
        for path in paths:
            self.inputs[str(path)] = None
            for place in {_place(path), os.path.normcase(os.path.realpath(path))}:
                self._read.setdefault(place, _Input(str(path), set())).mains.add(owner)
                if self._replaced.get(place) is False:
                    raise _replaces(str(path))

    def plan(self, main: Path, companions: Iterable[Path] = (), *, in_place: bool = False, suffix: str) -> None:
        """Add files that are replaced. Raises UsageError for an input, or another output.

        suffix: of the name by which `main` is written: a link to an input of another format is not in its place.
        """
        owner = {os.path.realpath(main)}
        for path in (main, *companions):
            place = _place(path)
            found = self._read.get(place)
            is_own = found is not None and found.mains == owner
            if found is not None and is_own and in_place and path == main and not _has_suffix(suffix, found.name, main):
                raise RefusedOutputError(
                    f"{found.name}: is an input of another format, and would be replaced through a link "
                    "(expected another file)"
                )
            if found is not None and not (in_place and is_own):
                raise _replaces(found.name, "" if path == main else str(main))
            again = in_place and self._replaced.get(place) is True  # a product that was tried before
            if not again and (place in self._replaced or place in self._new):
                raise _is_twice(path)
            self._replaced[place] = in_place

    def plan_new(self, paths: Iterable[Path]) -> None:
        """Add files with free names, or with the bytes of the file there. Raises UsageError for another output."""
        for path in paths:
            if (place := _place(path)) in self._replaced:
                raise _is_twice(path)
            self._new.add(place)

    def add_copy(self, path: Path) -> None:
        """Add an image that was copied."""
        self.copies.append(path)

    def inputs_besides(self, main: Path) -> list[Path]:
        """Return the files that were added, without those that belong to `main` alone."""
        owner = {os.path.realpath(main)}
        return [Path(each.name) for each in self._read.values() if each.mains != owner]

    def begin(self) -> None:
        """Call what waits for the first change: its own files don't wait for it."""
        if (job := self.before_change) is not None:
            self.before_change = None
            with guard.use(None):
                job()


def add_inputs(main: Path, *others: Path) -> None:
    """Record files that were read: one, and those that belong to it."""
    add_companions(main, main, *others)


def add_companions(main: Path, *paths: Path) -> None:
    """Record files that were read, and belong to `main`."""
    if isinstance(files := guard.current(), CommandFiles):
        files.add_inputs(main, paths)


def inputs_besides(main: Path) -> list[Path]:
    """Return the files that were read so far, without those that belong to `main` alone."""
    files = guard.current()
    return files.inputs_besides(main) if isinstance(files, CommandFiles) else []


def take_copies() -> list[Path]:
    """Return the images that were copied since the last call."""
    if not isinstance(files := guard.current(), CommandFiles):
        return []
    found, files.copies = files.copies, []
    return found


def add_output(path: str, written: str = "") -> None:
    """Record a file that was written. written: the file itself where none has the name of the output."""
    if isinstance(files := guard.current(), CommandFiles):
        files.outputs[path] = written or path


def check_names(outputs: Mapping[str, str], others: Iterable[Any]) -> None:
    """Raise UsageError, before any work, if two outputs have one name, or one has that of an input.

    outputs: their names, by the option, "OUT" first; it can be an input. others: values of the arguments and options
    that name other files, texts or lists of them.
    """
    known: dict[str, str] = {}
    values = [each for value in others for each in (value if isinstance(value, list | tuple) else [value])]
    inputs = {os.path.realpath(each) for each in values if isinstance(each, str) and "\0" not in each}
    for option, path in outputs.items():
        if path in ("", PIPE) or "\0" in path or is_device_or_pipe(path) or descriptor_of(Path(path)) is not None:
            continue
        real = os.path.realpath(path)
        first = known.setdefault(real, option)
        if first != option or (option != "OUT" and real in inputs):
            name = first if first != option else "an input"
            raise UsageError(f"{path}: {option} would replace {name} (expected another file)")
        if path not in values and real in inputs and PurePath(real).suffix.lower() != PurePath(path).suffix.lower():
            raise RefusedOutputError(f"{path}: is a link to an input of another format (expected another file)")


def _place(path: Path) -> str:
    """The folder of a file, with links resolved, and its name: of a link itself, which is what a rename replaces."""
    return os.path.normcase(os.path.join(os.path.realpath(path.parent), path.name))


def _has_suffix(suffix: str, *names: str | Path) -> bool:
    return suffix.lower() in {PurePath(each).suffix.lower() for each in names}


def _replaces(input: str, output: str = "") -> RefusedOutputError:
    if output:
        return RefusedOutputError(
            f"{input}: would be replaced by the file of this name beside {output}", help="choose another name for OUT"
        )
    return RefusedOutputError(f"{input}: is an input, and would be replaced by an output (expected another file)")


def _is_twice(path: Path) -> RefusedOutputError:
    return RefusedOutputError(f"{path}: two outputs would be written to this file (expected different files)")
