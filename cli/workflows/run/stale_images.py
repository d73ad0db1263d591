"""Stale images: those that runs copied beside outputs which are deleted now."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path

from anim.errors import AnimError
from anim.gltf.io.container import SUFFIXES
from anim.gltf.io.file_references import find_referenced, find_references_around, place_of
from cli.io import input_files
from cli.workflows.run.outputs import OutputRecord


class StaleImages:
    """Images that may be deleted with some outputs: of those that these name, the ones that a run copied.

    Made while the outputs are still there.
    """

    def __init__(self, record: OutputRecord, outputs: Sequence[str]) -> None:
        self._folder = record.folder
        files = [record.folder / name for name in outputs] if record.copies else []
        named = _if_readable(partial(find_referenced, files)) or set()
        places = {name: place_of(record.folder / name) for name in record.copies}
        self._places = {name: place for name, place in places.items() if place in named}
        self._are_unchanged = record.is_unchanged_copy

    def delete(self, kept: Iterable[str]) -> list[str]:
        """Delete the images that are as they were copied, and that nothing else refers to; return their names.

        kept: files that remain and may refer to them, or are one of them: outputs, and what runs and checks read.
        Other glTF files count below the folder of the settings, and in the images' folders and above, with links. If
        one of all these can't be read, every image remains.
        """
        names = [name for name in self._places if self._are_unchanged(name) and self._is_plain(name)]
        if not names:
            return []
        files = [self._folder / each for each in kept]
        used = _if_readable(lambda: find_referenced(sorted({*filter(_is_document, files), *self._documents()})))
        near = _if_readable(partial(find_references_around, [self._places[name] for name in names]))
        if used is None or near is None:
            return []
        used |= near | {place_of(file) for file in files}
        return [name for name in names if self._places[name] not in used and self._unlink(name)]

    def _documents(self) -> Iterator[Path]:
        """Yield all glTF files below the folder of the settings. Raises FormatError for a folder that can't be read."""
        for folder, _, names in input_files.walk(self._folder):
            yield from filter(_is_document, (Path(folder, name) for name in names))

    def _is_plain(self, name: str) -> bool:
        """Return whether no link is on the way to an image."""
        return self._places[name] == os.path.normcase(os.path.join(os.path.realpath(self._folder), name))

    def _unlink(self, name: str) -> bool:
        with suppress(OSError):
            (self._folder / name).unlink()
            return True
        return False


def _is_document(path: Path) -> bool:
    return path.suffix.lower() in SUFFIXES and path.is_file()


def _if_readable(find: Callable[[], set[str]]) -> set[str] | None:
    """The places that a search finds; None if a file can't be read, which may refer to any."""
    try:
        return find()
    except (AnimError, OSError, RecursionError):
        return None
