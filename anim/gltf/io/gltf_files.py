"""A .gltf and the buffers beside it: the rename of the .gltf is the only moment at which the pair changes.

New buffers take names that are free: `walk.bin`, else one made from their content (`walk-1a2b3c4d.bin`). So neither the
.gltf that is there nor any other file loses its buffer before, and after it each reader finds a whole pair. A buffer
of the .gltf that was replaced goes afterwards, if nothing beside it names it too.
"""

from __future__ import annotations

import hashlib
import mmap
import os
import posixpath
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass, field
from pathlib import Path, PurePath

import numpy as np

from anim.errors import AnimError, OutputError
from anim.files import atomic, links, signals
from anim.gltf.document import Bytes, Document, json_array
from anim.gltf.io import container, uri

DIGEST_LENGTHS = (8, 16, 64)  # hex digits of SHA-256 in a name, for as long as others have the shorter ones
GLTF_SUFFIXES = (".glb", ".gltf", ".vrm", ".vrma")


def write(
    document: Document,
    path: Path,
    *,
    same_folder: bool,
    spared: Sequence[Path] = (),
    text: Bytes | None = None,
    dry_run: bool = False,
) -> int:
    """Write a .gltf and those of its buffers that are files; return the bytes of what this is or would be.

    same_folder: as the input; buffers that are files there and have not changed stay these. spared: files that are
    never removed, since the input needs them. text: the document's own, which stays where all its buffers do. A link is
    followed: the pair lies where it leads to.
    """
    named, path = path, links.resolve_links(path)
    if path.exists() and not path.is_file():
        raise OutputError(f"{named}: is no plain file (a .gltf needs a folder for its buffers)", help="write a .glb")
    with nullcontext() if dry_run else atomic.locked(path.parent):
        names = _Names(path.parent, _external(path))
        files = container.gltf(document, path.stem, keep_external=same_folder, choose=names.choose)
        made = files.pop(f"{path.stem}.gltf")
        content = made if text is None or files else [text]
        if not dry_run:
            with atomic.named_errors(named):
                atomic.check_writable(path)
                new = {path.parent / name: pieces for name, pieces in files.items() if name not in names.reused}
                _commit(path, content, new)
                _remove(names.old, path, content, spared)
    return sum(len(piece) for pieces in (content, *files.values()) for piece in pieces)


@dataclass
class _Names:
    """Names of new buffers in a folder. old: buffers of the .gltf that is there, "" for those that are no files.

    reused: chosen names of files that hold the bytes already.
    """

    folder: Path
    old: Sequence[str]
    reused: set[str] = field(default_factory=set)

    def choose(self, number: int, preferred: str, data: Bytes) -> str:
        """Return the name for buffer `number`: that of a file with equal bytes, else one that is free."""
        before = self.old[number : number + 1]
        if before and before[0] and self._holds(before[0], data):
            return before[0]
        for name in _candidates(preferred, data):
            if not os.path.lexists(self.folder / name) or self._holds(name, data):
                return name
        raise OutputError(f"{self.folder / preferred}: is there already, with other content")

    def _holds(self, name: str, data: Bytes) -> bool:
        path = self.folder / name
        is_equal = not path.is_symlink() and atomic.has_bytes(path, [data])
        if is_equal:
            self.reused.add(name)
        return is_equal


def _candidates(preferred: str, data: Bytes) -> Iterator[str]:
    yield preferred
    digest = hashlib.sha256(data.data).hexdigest()
    name = PurePath(preferred)
    yield from (f"{name.stem}-{digest[:length]}{name.suffix}" for length in DIGEST_LENGTHS)


def _commit(path: Path, text: list[Bytes], new: Mapping[Path, list[Bytes]]) -> None:
    """Put new buffers where nothing is, then the .gltf; where that fails, they are gone again."""
    with atomic.temporaries() as made:
        waiting = {place: atomic.write_temporary(place, pieces, made) for place, pieces in new.items()}
        is_there = atomic.has_bytes(path, text)
        main = None if is_there else atomic.write_temporary(path, text, made)
        with signals.hold_signals(), atomic.temporaries() as placed:
            for place, temporary in waiting.items():
                atomic.move_to_free(temporary, place)
                placed.append(place)
            if main is None:
                os.utime(path)
            else:
                os.replace(main, path)
            placed.clear()


def _remove(old: Sequence[str], path: Path, text: list[Bytes], spared: Sequence[Path]) -> None:
    """Remove buffers that the .gltf at `path` no longer names, and that nothing else is known to need."""
    named = _named(container.read(np.concatenate(text)))
    for name in old:
        there = path.parent / name
        if not name or PurePath(name).name != name or there.is_symlink() or not there.is_file():
            continue
        needed = [*(path.parent / each for each in named), *spared]
        if any(each.exists() and each.samefile(there) for each in needed) or _is_named_beside(there, path):
            continue
        with suppress(OSError):
            there.unlink()


def _is_named_beside(buffer: Path, path: Path) -> bool:
    """Return whether another glTF in the folder needs the file, or can't be asked."""
    for other in sorted(buffer.parent.iterdir()):
        if other.suffix.lower() in GLTF_SUFFIXES and other.name != path.name:
            try:
                if _may_name(_mapped(other), buffer.name) and buffer.name in _named(_opened(other)):
                    return True
            except (AnimError, OSError, RecursionError):
                return True
    return False


def _may_name(data: mmap.mmap | bytes, name: str) -> bool:
    """Return False where the name does not occur in the JSON: quick, in folders of many files."""
    is_glb = data[:4] == container.MAGIC
    end = 20 + int.from_bytes(data[12:16], "little") if is_glb else len(data)
    return re.fullmatch(r"[\w.-]+", name, re.ASCII) is None or data.find(name.encode(), 0, end) >= 0


def _external(path: Path) -> tuple[str, ...]:
    """Names of the buffers that the .gltf at `path` has as files, "" for others; none where there is no such file."""
    try:
        document = _opened(path)
        return tuple(_file_of(buffer.uri) for buffer in document.buffers)
    except (AnimError, OSError, RecursionError):
        return ()


def _named(document: Document) -> set[str]:
    """Names of all files that a document refers to."""
    addresses = [buffer.uri for buffer in document.buffers] + [
        i.get("uri") for i in json_array(document.json, "images")
    ]
    return {_file_of(address) for address in addresses} - {""}


def _file_of(address: str | None) -> str:
    try:
        return "" if address is None or uri.is_data(address) else posixpath.normpath(uri.relative_path(address))
    except AnimError:
        return ""


def _opened(path: Path) -> Document:
    return container.read(np.frombuffer(_mapped(path), np.uint8))


def _mapped(path: Path) -> mmap.mmap | bytes:
    with path.open("rb") as file:
        return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) if os.fstat(file.fileno()).st_size else b""
