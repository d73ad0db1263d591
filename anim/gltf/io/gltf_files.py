"""A .gltf and the buffers beside it: the rename of the .gltf is the only moment at which the pair changes.

New buffers take names that are free: `walk.bin`, else one made from their content (`walk-1a2b3c4d.bin`). So neither the
.gltf that is there nor any other file loses its buffer before, and after it each reader finds a whole pair. A buffer
of the .gltf that was replaced goes afterwards, if it is one of ours (`anim.gltf.io.unused_buffers`).
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import TypeAlias

from anim.errors import OutputError
from anim.files import atomic, links, signals
from anim.gltf.document import Bytes, Document
from anim.gltf.io import container, unused_buffers

Note: TypeAlias = Callable[[str], object]


def write(
    document: Document,
    path: Path,
    *,
    same_folder: bool,
    spared: Sequence[Path] = (),
    text: Bytes | None = None,
    dry_run: bool = False,
    note: Note = lambda words: None,
) -> int:
    """Write a .gltf and those of its buffers that are files; return the bytes of what this is or would be.

    same_folder: as the input; buffers that are files there and have not changed stay these. spared: files that are
    never removed, since the input needs them. text: the document's own, which stays where all its buffers do. note: is
    told of files that were buffers of the .gltf and stay. A link is followed: the pair lies where it leads to.
    """
    named, path = path, links.resolve_links(path)
    if path.exists() and not path.is_file():
        raise OutputError(f"{named}: is no plain file (a .gltf needs a folder for its buffers)", help="write a .glb")
    with nullcontext() if dry_run else atomic.lock_folder(path.parent):
        names = _Names(path.parent, unused_buffers.external_buffers(path))
        files = container.gltf(document, path.stem, keep_external=same_folder, choose=names.choose)
        made = files.pop(f"{path.stem}.gltf")
        content = made if text is None or files else [text]
        if not dry_run:
            with atomic.name_errors(named):
                atomic.check_writable(path)
                new = {path.parent / name: pieces for name, pieces in files.items() if name not in names.reused}
                _commit(path, content, new)
                for name in unused_buffers.remove_unused(names.old, path, content, spared):
                    note(f"'{name}' is not used by {path.name} any more; delete it if nothing else needs it")
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
    yield from (f"{name.stem}-{digest[:length]}{name.suffix}" for length in unused_buffers.DIGEST_LENGTHS)


def _commit(path: Path, text: list[Bytes], new: Mapping[Path, list[Bytes]]) -> None:
    """Put new buffers where nothing is, then the .gltf; where that fails, they are gone again."""
    with atomic.temporary_files() as made:
        waiting = {place: atomic.write_temporary(place, pieces, made) for place, pieces in new.items()}
        is_there = atomic.has_bytes(path, text)
        main = None if is_there else atomic.write_temporary(path, text, made)
        with signals.hold_signals(), atomic.temporary_files() as placed:
            for place, temporary in waiting.items():
                atomic.move_to_free(temporary, place)
                placed.append(place)
            if main is None:
                os.utime(path)
            else:
                os.replace(main, path)
            placed.clear()
