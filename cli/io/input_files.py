"""Input files named by a path, a folder, or a pattern with `**`."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from anim.errors import FormatError
from anim.gltf.io import container
from cli.errors import NoFileError
from cli.io import documents
from cli.io.path_patterns import can_match_below


class FoundFile(NamedTuple):
    """An input file. folder: the named folder, the fixed part of the pattern, or that of the file.

    is_searched: True if a folder or a pattern led to it.
    """

    path: str
    folder: str
    is_searched: bool = False


def expand(inputs: Sequence[str]) -> list[str]:
    """Return the files of all inputs, each once: files as they are, of folders all glTF files below them.

    A pattern is for shells that do not expand it, or for "**". Raises NoFileError if one matches nothing, and
    FormatError for a folder that can't be read.
    """
    return [found.path for found in find(inputs)]


def find(inputs: Sequence[str]) -> list[FoundFile]:
    """Return the files of all inputs, like `expand`, with the folders that they were found in."""
    found: dict[str, FoundFile] = {}
    for each in inputs:
        for file in _find_one(each):
            found.setdefault(file.path, file)
    return list(found.values())


def _find_one(path: str) -> list[FoundFile]:
    if path in ("", documents.PIPE):  # an empty name is refused where it is opened
        return [FoundFile(path, "")]
    if os.path.isdir(path):  # False, not an error, for names that no file can have
        found = sorted(_in_folder(Path(path)))
        if not found:
            raise NoFileError(f"{path}: has no {' or '.join(container.SUFFIXES)} file")
        return [FoundFile(each, path, is_searched=True) for each in found]
    return _matches(path) if not os.path.lexists(path) else [_named(path)]


def _named(path: str) -> FoundFile:
    return FoundFile(path, os.path.dirname(path) or ".")


def _matches(pattern: str) -> list[FoundFile]:
    import glob  # compiles expressions, and few names are patterns

    if not glob.has_magic(pattern):
        return [_named(pattern)]
    found = sorted(each for each in glob.glob(pattern, recursive=True) if os.path.isfile(each))
    folder = os.path.dirname(pattern)
    while glob.has_magic(folder):
        folder = os.path.dirname(folder)  # the part before the first wildcard: "in" of "in/**/*.glb"
    if ".." not in Path(pattern).parts:  # `relpath` would lead elsewhere than links do
        _check_readable(Path(folder or "."), Path(os.path.relpath(pattern, folder or ".")))
    if not found:
        raise NoFileError(f"{pattern}: matches no file")
    return [FoundFile(each, folder or ".", is_searched=True) for each in found]


def _check_readable(folder: Path, pattern: Path) -> None:
    """Raise FormatError for a folder that can't be read and may have matching files: `glob` leaves them out.

    pattern: from the folder.
    """
    named = {part for part in pattern.parts if part.startswith(".")}  # wildcards stand for no other hidden folder
    for place, folders, _ in walk(folder):
        above = Path(place).relative_to(folder)
        visible = (each for each in folders if not each.startswith(".") or each in named)
        folders[:] = (each for each in visible if can_match_below((above / each).as_posix(), pattern.as_posix()))


def walk(folder: Path) -> Iterator[tuple[str, list[str], list[str]]]:
    """Yield folders with their folders and files as `os.walk` does; those behind links are none.

    Raises FormatError for a folder that can't be read, whose files would be left out without a word. One that isn't
    there has none.
    """
    return os.walk(folder, onerror=_refuse)


def _refuse(error: OSError) -> None:
    if not isinstance(error, FileNotFoundError | NotADirectoryError):
        reason = (error.strerror or str(error)).lower()
        raise FormatError(f"can't be read ({reason})", where=str(error.filename)) from None


def _in_folder(folder: Path) -> Iterator[str]:
    """Names of the glTF files below a folder, without hidden ones and hidden folders."""
    for place, folders, names in walk(folder):
        folders[:] = (each for each in folders if not each.startswith("."))
        for name in names:
            path = Path(place, name)
            if not name.startswith(".") and path.suffix.lower() in container.SUFFIXES and path.is_file():
                yield str(path)
