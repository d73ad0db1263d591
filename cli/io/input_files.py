"""Input files named by a path, a folder, or a pattern with `**`."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from anim.errors import NotFoundError
from anim.gltf.io import container
from cli.io import documents


def expand(inputs: Sequence[str]) -> list[str]:
    """Return the files of all inputs, each once: files as they are, of folders all glTF files below them.

    A pattern is for shells that do not expand it, or for "**". Raises NotFoundError if one matches nothing.
    """
    found = [path for each in inputs for path in _expand_one(each)]
    return list(dict.fromkeys(found))


def _expand_one(path: str) -> list[str]:
    if path in ("", documents.PIPE):  # an empty name is refused where it is opened
        return [path]
    if os.path.isdir(path):  # False, not an error, for names that no file can have
        found = sorted(_in_folder(Path(path)))
        if not found:
            raise NotFoundError(f"{path}: has no {' or '.join(container.SUFFIXES)} file")
        return found
    if glob.has_magic(path) and not os.path.lexists(path):
        found = sorted(each for each in glob.glob(path, recursive=True) if os.path.isfile(each))
        if not found:
            raise NotFoundError(f"{path}: matches no file")
        return found
    return [path]


def _in_folder(folder: Path) -> Iterator[str]:
    """Names of the glTF files below a folder, without hidden folders."""
    for each in folder.rglob("*"):
        hidden = any(part.startswith(".") for part in each.relative_to(folder).parts)
        if not hidden and each.suffix.lower() in container.SUFFIXES and each.is_file():
            yield str(each)
