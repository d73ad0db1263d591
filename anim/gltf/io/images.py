"""External images of a glTF: copied to the output's folder or embedded in the file.

Only files that are images by name and by first bytes: a document can name any file beside it as its image, and where a
copy lies, other programs may take it for settings or code (`pyproject.toml`, `.bash_login`).
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from anim.errors import FormatError, OutputError
from anim.files import atomic, guard, resolver
from anim.files.special_files import open_regular
from anim.gltf.document import Bytes, Document, Json, json_array
from anim.gltf.io import uri
from anim.gltf.io.content_names import content_names

SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".avif", ".gif", ".bmp", ".ktx2", ".dds")
# By place in the file; the first two are glTF's own, the others those of its extensions, and what loaders show too
SIGNATURES = (
    (0, b"\x89PNG", "image/png"),
    (0, b"\xff\xd8", "image/jpeg"),
    (8, b"WEBP", "image/webp"),
    (4, b"ftypavi", "image/avif"),
    (0, b"\xabKTX 20", "image/ktx2"),
    (0, b"DDS ", "image/vnd-ms.dds"),
    (0, b"GIF8", "image/gif"),
    (0, b"BM", "image/bmp"),
)
HEAD_BYTES = 12  # that have every signature


def copy_images(document: Document, folder: Path, target: Path) -> tuple[Document, dict[Path, Path]]:
    """Return a document moved from `folder` to `target`, and the images to copy: their files by new path.

    They keep their relative paths, and the URIs are unchanged. If another file has the name, the copy is named after
    its content (`skin-1a2b3c4d.png`). References to what is no image, or can't be read, are unchanged.
    """
    copies: dict[Path, Path] = {}
    images: list[Json] = []
    for image in json_array(document.json, "images"):
        if (file := find_image(folder, image)) is not None:
            own = uri.relative_path(image["uri"])
            name = _free(target, own, file, copies)
            copies[target / name] = file
            image = image if name == own else {**image, "uri": uri.from_path(name)}
        images.append(image)
    changed = replace(document, json={**document.json, "images": images}) if copies else document
    return changed, copies


def write_copies(copies: Mapping[Path, Path], within: Path | None = None) -> bool:
    """Copy images to free names; an existing file there has the same bytes, and stays. Raises OutputError.

    Those that are written are named to the guard. within: a folder that none of them may leave by a link. Returns False
    if another process gave a name to another file meanwhile, as one of the same run does: names must be chosen again.
    """
    if within is not None:
        for path in copies:
            _check_place(path, within)
    if copies:
        guard.begin()
    return all(_write_copy(path, file) for path, file in copies.items())


def _write_copy(path: Path, file: Path) -> bool:
    with atomic.name_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists():
            return _is_same(path, file)
        with atomic.temporary_files() as made:
            temporary = atomic.write_temporary(path, _blocks(file), made)
            try:
                atomic.move_to_free(temporary, path)
            except FileExistsError:
                return _is_same(path, file)
            guard.add_copy(path)
    return True


def _check_place(path: Path, folder: Path) -> None:
    with atomic.name_errors(path):
        if not path.exists() and not path.resolve().is_relative_to(folder.resolve()):
            raise OutputError(f"{path}: leads out of '{folder}' by a link")


def embed(document: Document, folder: Path | None) -> Document:
    """Return the document with its external images as data URIs, as far as they are images that can be read."""
    images = [
        image if (file := find_image(folder, image)) is None else {**image, "uri": _data_uri(file)}
        for image in json_array(document.json, "images")
    ]
    return replace(document, json={**document.json, "images": images}) if images else document


def external_uri(image: Json) -> str:
    """Return the URI of an external image, else ""."""
    address = str(image.get("uri", ""))
    return "" if uri.is_data(address) else address


def find_image(folder: Path | None, image: Json) -> Path | None:
    """Return the file of an external image; None for others, for no image, or if it can't be read."""
    file = locate_image(folder, image)
    return file if file is not None and is_image(file, image) else None


def is_image(file: Path, image: Json) -> bool:
    """Return whether the file that an external image names is an image, by its name and its first bytes."""
    if not _is_image_name(uri.relative_path(image["uri"])):
        return False
    try:
        with open_regular(file) as opened:
            return bool(media_type(opened.read(HEAD_BYTES)))
    except OSError:
        return False


def locate_image(folder: Path | None, image: Json) -> Path | None:
    """Return the file that an external image names, of any kind; None if there is none in the folder or below."""
    address = external_uri(image)
    if not address or folder is None:
        return None
    try:
        path = uri.relative_path(address)
        if not os.path.lexists(folder / path):  # before links are resolved, which takes ten times as long
            return None
        return resolver.locate(folder, path)
    except FormatError:
        return None


def media_type(head: bytes) -> str:
    """Return the media type of an image by its first bytes (`HEAD_BYTES`); "" for what is none."""
    return next((media for at, magic, media in SIGNATURES if head.startswith(magic, at)), "")


def _is_image_name(path: str) -> bool:
    """Return whether a relative path ends as that of an image, and no part of it is hidden."""
    hidden = any(part.startswith(".") and part != "." for part in re.split(r"[/\\]", path))
    return not hidden and path.lower().endswith(SUFFIXES)


def _free(target: Path, name: str, file: Path, copies: Mapping[Path, Path]) -> str:
    """The free name for a copy in the folder."""
    for each in content_names(name, partial(_digest, file)):
        if target / each in copies or not os.path.lexists(target / each) or _is_same(target / each, file):
            return each
    raise OutputError(f"{target / name}: is there already, with other content")


def _digest(file: Path) -> str:
    import hashlib

    with file.open("rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest()


def _is_same(path: Path, file: Path) -> bool:
    import filecmp

    return path.is_file() and filecmp.cmp(path, file, shallow=False)


def _blocks(file: Path) -> Iterator[Bytes]:
    with file.open("rb") as opened:
        while block := opened.read(atomic.BLOCK_BYTES):
            yield np.frombuffer(block, np.uint8)


def _data_uri(file: Path) -> str:
    data = resolver.read_file(file).tobytes()
    return uri.encode_data(data, media_type(data[:HEAD_BYTES]))
