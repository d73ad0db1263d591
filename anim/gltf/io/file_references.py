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
from anim.gltf.io import container, json_text, uri

NEAR_FOLDERS = 2  # a file's own and the one above: all files there are looked into, and unreadable ones need it
_HEAD_BYTES = 64  # bytes to detect a glTF
_BLANK = b"\xef\xbb\xbf \t\r\n"


def find_referenced(files: Iterable[Path]) -> set[str]:
    """Return the places (see `place_of`) of all files that glTF files refer to, also out of their folders.

    Raises AnimError or OSError for a file that can't be read.
    """
    return {place for file in files for place in _referenced(file, json_text.parse(read_json(file)))}


def find_references_around(places: Iterable[str]) -> set[str]:
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


def find_uris(json: Json) -> Iterator[str]:
    """Yield the URIs of buffers and images in JSON of glTF, which may be invalid."""
    for key in ("buffers", "images"):
        found = json.get(key)
        for each in found if isinstance(found, list) else ():
            if isinstance(each, dict) and isinstance(address := each.get("uri"), str):
                yield address


def is_called_gltf(path: Path) -> bool:
    """Return whether an extension of glTF is in a name."""
    return any(suffix in path.name.lower() for suffix in container.SUFFIXES)


def begins_like_gltf(path: Path) -> bool:
    """Return whether the first bytes of a file are those of a GLB or of JSON. Raises OSError."""
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
    return head.startswith(container.MAGIC) or head.lstrip(_BLANK).startswith(b"{")


def read_json(path: Path) -> bytes:
    """Return the bytes of a .gltf, or of a GLB up to the end of its JSON. Raises OSError."""
    with path.open("rb") as file:
        head = file.read(20)
        is_glb = head.startswith(container.MAGIC)
        return file.read(int.from_bytes(head[12:16], "little")) if is_glb else head + file.read()


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
    for address in find_uris(content):
        name = "" if uri.is_data(address) else unquote(address, errors="surrogateescape")
        if name and "\0" not in name:
            yield place_of(posixpath.join(file.parent, name))
