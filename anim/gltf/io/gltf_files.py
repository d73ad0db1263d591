"""Write a .gltf and its .bin files; only the rename of the .gltf changes existing files.

New buffers take names that are free: `walk.bin`, else one made from their content (`walk-1a2b3c4d.bin`). So neither the
existing .gltf nor any other file loses a buffer before the rename, and afterwards every reader finds complete files.
Buffers that the replaced .gltf no longer uses are removed last, if this program wrote them
(`anim.gltf.io.unused_buffers`).
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from anim.errors import OutputError
from anim.files import atomic, guard, resolver, signals, special_files
from anim.files.folder_lock import lock_folder
from anim.gltf.document import Bytes, Document
from anim.gltf.io import container, unused_buffers
from anim.gltf.io.content_names import content_names
from anim.gltf.io.unused_buffers import Note


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
    """Write a .gltf and its external buffers; return their total size in bytes, also in a dry run.

    same_folder: the output is in the input's folder, so unchanged external buffers keep their files. spared: files that
    are never removed, since the input needs them. text: bytes of the input's .gltf, written again if no buffer changes
    its URI. note: called with a line about old buffers that are not removed. Links are followed: the files are written
    to the link's target folder.
    """
    named, path = path, resolver.resolve_links(path)
    if special_files.is_special(named):
        raise OutputError(f"{named}: is no plain file (a .gltf needs a folder for its buffers)", help="write a .glb")
    with nullcontext() if dry_run else lock_folder(path.parent):
        names = BufferNames.of_file(path.parent, path.name)
        files = container.gltf(document, path.stem, keep_external=same_folder, choose=names.choose)
        made = files.pop(f"{path.stem}.gltf")
        content = made if text is None or files else [text]
        guard.plan(path, in_place=True)
        guard.plan_new(path.parent / name for name in files)
        if not dry_run:
            with atomic.name_errors(named):
                atomic.check_writable(path)
                new = {path.parent / name: pieces for name, pieces in files.items() if name not in names.reused}
                _commit(path, content, new)
                unused_buffers.remove_unused(names.old, path, content, spared, note)
    return sum(len(piece) for pieces in (content, *files.values()) for piece in pieces)


def remove(paths: Sequence[Path], spared: Sequence[Path] = ()) -> None:
    """Remove files, and those buffers of .gltf files that this program wrote and that nothing else uses.

    spared: files that are never removed. The buffers follow when all files are gone, so that none of these counts as a
    user. Raises OutputError.
    """
    buffers: dict[Path, Sequence[str]] = {}
    for path in paths:
        with atomic.name_errors(path):
            if path.suffix.lower() == ".gltf":
                buffers[path] = unused_buffers.external_buffers(path)
            path.unlink(missing_ok=True)
    for path, old in buffers.items():
        with lock_folder(path.parent), atomic.name_errors(path):
            unused_buffers.remove_unused(old, path, (), spared, note=lambda words: None)


@dataclass
class BufferNames:
    """Names of new buffers in a folder.

    old: buffers of the existing .gltf, "" for those that are not files. reused: chosen names of existing files with the
    same bytes.
    """

    folder: Path
    old: Sequence[str]
    reused: set[str] = field(default_factory=set)

    @classmethod
    def of_file(cls, folder: os.PathLike[str], name: str) -> BufferNames:
        """Return the names for the .gltf of this name."""
        return cls(Path(folder), unused_buffers.external_buffers(Path(folder, name)))

    def choose(self, number: int, preferred: str, data: Bytes) -> str:
        """Return the name for buffer `number`: an existing file with equal bytes, else a free name."""
        before = self.old[number : number + 1]
        if before and before[0] and self._holds(before[0], data):
            return before[0]
        for name in content_names(preferred, partial(_digest, data)):
            if not os.path.lexists(self.folder / name) or self._holds(name, data):
                return name
        raise OutputError(f"{self.folder / preferred}: is there already, with other content")

    def _holds(self, name: str, data: Bytes) -> bool:
        path = self.folder / name
        is_equal = not path.is_symlink() and atomic.has_bytes(path, [data])
        if is_equal:
            self.reused.add(name)
        return is_equal


def _digest(data: Bytes) -> str:
    import hashlib

    return hashlib.sha256(data.data).hexdigest()


def _commit(path: Path, text: list[Bytes], new: Mapping[Path, list[Bytes]]) -> None:
    """Write new buffers to free names, then the .gltf; remove the buffers if that fails."""
    with atomic.temporary_files() as made:
        waiting = {place: atomic.write_temporary(place, pieces, made) for place, pieces in new.items()}
        is_there = atomic.has_bytes(path, text)
        main = None if is_there else atomic.write_temporary(path, text, made)
        guard.begin()
        with signals.hold_signals(), atomic.temporary_files() as placed:
            for place, temporary in waiting.items():
                atomic.move_to_free(temporary, place)
                placed.append(place)
            if main is None:
                os.utime(path)
            else:
                os.replace(main, path)
            placed.clear()
