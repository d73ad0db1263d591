"""Remove buffers that a replaced or removed .gltf no longer uses, if this program wrote them.

Their names derive from the .gltf (`walk.bin` of walk.gltf) or from their content (`walk-1a2b3c4d.bin`). They are
removed unless another glTF in the folder or its parent, of any file name (walk.gltf.bak), one farther up, or a link
refers to them.
Other files remain.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path, PurePath
from typing import TypeAlias

import numpy as np

from anim.errors import AnimError
from anim.files import resolver
from anim.gltf.document import Bytes, Document, Json
from anim.gltf.io import container, json_text, uri
from anim.gltf.io.content_names import DIGEST_LENGTHS
from anim.gltf.io.file_references import NEAR_FOLDERS, begins_like_gltf, find_uris, is_called_gltf, read_json

Note: TypeAlias = Callable[[str], object]


def external_buffers(path: Path) -> tuple[str, ...]:
    """Return names of the external buffers of the .gltf at `path`, "" for others; () without a file."""
    try:
        return tuple(_file_of(buffer.uri) for buffer in _opened(path).buffers)
    except (AnimError, OSError, RecursionError):
        return ()


@contextmanager
def replace_text(path: Path, spared: Sequence[Path] = (), note: Note = lambda words: None) -> Iterator[None]:
    """Remove the buffers of the .gltf at `path` that it doesn't use any more after the block, which replaces it."""
    old = external_buffers(path)
    yield
    if old:
        remove_unused(old, path, [resolver.read_file(path)], spared, note)


def remove_unused(old: Sequence[str], path: Path, text: Sequence[Bytes], spared: Sequence[Path], note: Note) -> None:
    """Remove the buffers `old` that neither the .gltf at `path` nor any other known file uses.

    text: of the .gltf, nothing if it was removed. spared: files that others need. note: called with a line about each
    unused file that remains, since this program did not write it.
    """
    named = _named(container.read(np.concatenate(text)).json) if text else ()
    needed = [*(path.parent / each for each in named), *spared]
    for name in sorted({*old} - {""}):
        there = path.parent / name
        if not there.is_file() or any(each.exists() and each.samefile(there) for each in needed):
            continue
        if _is_used_elsewhere(there, path):
            continue
        if PurePath(name).name == name and not there.is_symlink() and _is_ours(there, path.stem):
            with suppress(OSError):
                there.unlink()
        else:
            note(f"'{name}' is not used by {path.name} any more; delete it if nothing else needs it")


def _is_ours(buffer: Path, stem: str) -> bool:
    """True if a buffer is named after its .gltf or after its content."""
    lengths = "|".join(f"[0-9a-f]{{{length}}}" for length in DIGEST_LENGTHS)
    if re.fullmatch(rf"{re.escape(stem)}(-\d+){{0,2}}(-({lengths}))?\.bin", buffer.name):
        return True
    found = re.fullmatch(rf".+-({lengths})\.bin", buffer.name, re.DOTALL)
    if found is None:
        return False
    import hashlib

    with buffer.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest().startswith(found[1])


def _is_used_elsewhere(buffer: Path, path: Path) -> bool:
    """True if a glTF in the folder or one above, an unreadable file in the nearest two or a link uses the buffer.

    Files farther up count if they have an extension of glTF.
    """
    folder = path.parent.resolve()
    name = buffer.relative_to(path.parent).as_posix()
    buffer = folder / name
    for depth, place in enumerate((folder, *folder.parents)):
        address = posixpath.normpath(posixpath.join(folder.relative_to(place).as_posix(), name))
        try:
            others = sorted(place.iterdir())
        except OSError:
            if depth < NEAR_FOLDERS:
                return True
            continue
        near = others if depth < NEAR_FOLDERS else [each for each in others if is_called_gltf(each)]
        if any(other != folder / path.name and _needs(other, buffer, address, depth) for other in near):
            return True
    return False


def _needs(other: Path, buffer: Path, address: str, depth: int) -> bool:
    """True if a file is a glTF or a link that refers to the buffer. address: from the file's folder, `depth` above."""
    try:
        if other.is_symlink() and other != buffer and other.samefile(buffer):
            return True
    except OSError:  # a broken link
        return False
    is_called_so = is_called_gltf(other)
    try:
        if not other.is_file() or not (is_called_so or begins_like_gltf(other)):
            return False
        content = read_json(other)
        return _may_name(content, buffer.name) and address in _named(json_text.parse(content))
    except (AnimError, OSError, RecursionError):
        return is_called_so and depth < NEAR_FOLDERS


def _may_name(json: bytes, name: str) -> bool:
    """Return False if the name is not in the JSON: a fast test for folders with many files."""
    is_plain = re.fullmatch(r"[\w.-]+", name, re.ASCII) is not None and b"%" not in json and b"\\u" not in json
    return not is_plain or name.encode() in json


def _named(json: Json) -> set[str]:
    """Names of all files that JSON of glTF, which may be invalid, refers to."""
    return {_file_of(address) for address in find_uris(json)} - {""}


def _file_of(address: str | None) -> str:
    try:
        return "" if address is None or uri.is_data(address) else posixpath.normpath(uri.relative_path(address))
    except AnimError:
        return ""


def _opened(path: Path) -> Document:
    with path.open("rb") as file:
        return container.read(file.read())
