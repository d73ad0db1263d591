"""Find the files that glTF files in some folders refer to: buffers and images, wherever they are."""

from __future__ import annotations

import os
import posixpath
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from urllib.parse import unquote

from anim.errors import AnimError
from anim.gltf.document import Json
from anim.gltf.io import json_text, uri
from anim.gltf.io.unused_buffers import NEAR_FOLDERS, begins_like_gltf, is_called_gltf, read_json


def find_referenced(files: Iterable[Path]) -> set[str]:
    """Return the places (see `place_of`) of all files that glTF files refer to, also out of their folders.

    Raises AnimError or OSError for a file that can't be read.
    """
    return {place for file in files for place in _referenced(file, json_text.parse(read_json(file)))}


def find_near(places: Iterable[str]) -> set[str]:
    """Return what is referred to, by links too, in the folders of some places and in those above.

    In a place's own folder and in the one above every glTF counts, whatever its name; farther up those that are called
    so. Raises AnimError or OSError if one of the near ones, or its folder, can't be read.
    """
    folders = {Path(place).parent for place in places}
    near = {above for folder in folders for above in (folder, *folder.parents)[:NEAR_FOLDERS]}
    far = {above for folder in folders for above in folder.parents} - near
    found = {place for folder in near for place in _in_folder(folder)}
    for folder in far:
        try:
            others = [each for each in folder.iterdir() if is_called_gltf(each)]
        except OSError:
            continue
        for other in others:
            try:
                found |= find_referenced([other])
            except (AnimError, OSError, RecursionError):
                continue
    return found


def place_of(path: str | Path) -> str:
    """Return the real path of a file, equal for all its names."""
    return os.path.normcase(os.path.realpath(path))


def _in_folder(folder: Path) -> Iterator[str]:
    for each in sorted(folder.iterdir()):
        if each.is_symlink():
            yield place_of(each)
        if not each.is_file():
            continue
        if is_called_gltf(each):
            yield from find_referenced([each])
        elif begins_like_gltf(each):
            with suppress(AnimError):  # other JSON
                yield from find_referenced([each])


def _referenced(file: Path, content: Json) -> Iterator[str]:
    lists = [found for key in ("buffers", "images") if isinstance(found := content.get(key), list)]
    for address in (each.get("uri") for found in lists for each in found if isinstance(each, dict)):
        if isinstance(address, str) and not uri.is_data(address):
            name = unquote(address, errors="surrogateescape")
            if "\0" not in name:
                yield place_of(posixpath.join(file.parent, name))
