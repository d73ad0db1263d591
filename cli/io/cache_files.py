"""Vertex caches in files and pipes: formats of paths, and reading and writing frame by frame."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np

from anim.caches import registry
from anim.caches.formats import mesh_sequence
from anim.caches.options import ReadOptions, WriteOptions, WriteResult
from anim.caches.registry import CACHE_FORMATS, Files, sniff_format
from anim.caches.storage import suffix
from anim.caches.temporary_files import temporary_folder
from anim.errors import AnimError, DataRangeError, FormatError, OutputError, not_written
from anim.files import resolver
from anim.files.atomic import AtomicOutputs
from anim.gltf.io.unused_buffers import replace_text
from anim.model import VertexCache
from anim.units import plural
from cli.errors import UsageError
from cli.io import cache_folders, command_files, documents
from cli.text import Reporter

STDIN = "stdin"
BVH = ".bvh"  # motion of joints, for other commands
CommitWith: TypeAlias = Callable[[cache_folders.StagedFolder], AbstractContextManager[None]]


@dataclass(frozen=True, slots=True)
class LoadedCache:
    """An open cache, its name for messages, its format's file extension, and the notes of its reader."""

    cache: VertexCache
    name: str
    ending: str
    notes: tuple[str, ...]
    _folder: cache_folders.CacheFolder

    @property
    def size(self) -> int:
        """Bytes of all files opened so far."""
        return sum(self._folder.sizes.values())

    @property
    def files(self) -> list[Path]:
        """Paths of all files opened so far, the main one first; none of stdin."""
        return [] if self.name == STDIN else self._folder.paths


@dataclass(frozen=True, slots=True)
class SavedCache:
    """Written files, the main one last, their total size in bytes, and notes.

    orphans: warnings of frames of before, which programs read as a part of what was written.
    """

    files: tuple[str, ...]
    size: int
    written: WriteResult
    orphans: tuple[str, ...] = ()

    def report(self, reporter: Reporter) -> None:
        """Report warnings and notes."""
        for words in self.orphans:
            reporter.warn(words)
        for note in self.written.notes:
            reporter.info(f"note: {note}")


def commit_alone(_staged: cache_folders.StagedFolder) -> AbstractContextManager[None]:
    """Make no output beside a cache."""
    return nullcontext()


@contextmanager
def load(path: str, reading: ReadOptions, *, staged: cache_folders.StagedFolder | None = None) -> Iterator[LoadedCache]:
    """Give the cache at `path`, "-" for stdin, its format by file extension or by its first bytes.

    Its frames are read on demand, so use it inside the block; errors raised there name the input.
    staged: its files, if they are not yet renamed.
    """
    name = STDIN if path == documents.PIPE else path or "''"
    notes: list[str] = []
    with ExitStack() as stack:
        try:
            inputs = cache_folders.inputs(path, stack) if staged is None else staged
            ending = _ending(inputs)
            if path == documents.PIPE:
                check_pipe(name, ending)
            read = registry.reader_for(ending)
            cache = read(inputs, replace(reading, note=notes.append))
            yield LoadedCache(cache, name, ending, tuple(notes), inputs)
        except (UsageError, OutputError):
            raise
        except (np.linalg.LinAlgError, OverflowError) as error:
            raise DataRangeError(f"has values too large to compute with ({str(error).lower()})", where=name) from None
        except AnimError as error:
            raise error.at(name, ": ") from None


def check(
    path: str, ending: str | None = None, placeholders: Sequence[str] | None = (), *, makes_folder: bool = False
) -> str:
    """Return the file extension of the format of `path`: its own, or `ending`; ".npz" for "-" without one.

    Raises UsageError, before any work, if nothing can be written, the format is unknown, `ending` contradicts the
    extension of the name, or a pipe can't take the format. placeholders, makes_folder: see `documents.check_file`.
    """
    own = "" if path == documents.PIPE else suffix(path)
    if path == documents.PIPE:
        check_pipe("stdout", ending or ".npz")
    else:
        documents.check_file(path, placeholders, makes_folder=makes_folder)
    if ending and own in CACHE_FORMATS and own != ending:
        raise UsageError(
            f"{path}: the name says {own[1:]}, --format says {ending[1:]}",
            help="leave --format out, or change the name",
        )
    found = ending or own or (".npz" if path == documents.PIPE else "")
    if found not in CACHE_FORMATS:
        raise UsageError(
            f"{path}: unsupported cache format '{found}' (expected {', '.join(CACHE_FORMATS)})",
            help="gltf-anim to-euler writes BVH" if found == BVH else "",
        )
    return found


def check_pipe(name: str, ending: str) -> None:
    """Raise UsageError for a format of several files, which a pipe can't take."""
    if ending in CACHE_FORMATS and CACHE_FORMATS[ending].files is Files.SEVERAL:
        raise UsageError(f"{name}: {ending[1:]} is several files (expected a file name)")


def save(
    cache: VertexCache,
    path: str,
    writing: WriteOptions,
    *,
    ending: str,
    dry_run: bool = False,
    commit_with: CommitWith = commit_alone,
) -> SavedCache:
    """Write a cache, "-" for stdout, in the format that `check` returned.

    Companion files (a rest mesh) are left out on stdout, with a note.
    commit_with: makes other outputs of the written files, and replaces theirs after the cache's: an error of it leaves
    all files as they were. Not called for stdout.
    """
    is_pipe = path == documents.PIPE
    if is_pipe and CACHE_FORMATS[ending].files is Files.FRAMES and cache.frame_count > 1:
        raise UsageError(
            f"stdout: {ending[1:]} is a file a frame, of {cache.frame_count} (expected a file name)",
            help="convert-cache --at takes one of them",
        )
    unused: tuple[str, ...] = ()
    with ExitStack() as stack:
        away = stack.enter_context(temporary_folder()) if is_pipe or dry_run else ""
        staged = cache_folders.outputs(path, away, dry_run=dry_run)
        try:
            written = registry.writer_for(ending)(cache, staged, writing)
            names = staged.names[-1:] if is_pipe else staged.names
            size = staged.size(names)
            if is_pipe and not dry_run:
                cache_folders.to_stdout(staged)
            elif not is_pipe:
                with commit_with(cache_folders.StagedFolder(staged)):
                    unused = _commit(staged, path, ending, dry_run=dry_run)
        except OSError as error:
            raise not_written(away if is_pipe else path, error) from None
        finally:
            staged.clear()
    lost = unsupported_notes(cache, ending)
    left = unwritable_note(staged.names[:-1]) if is_pipe else unused
    orphans = () if is_pipe else orphan_warnings(path, names, ending)
    return SavedCache(names, size, replace(written, notes=(*written.notes, *lost, *left)), orphans)


def _commit(staged: AtomicOutputs, path: str, ending: str, *, dry_run: bool) -> tuple[str, ...]:
    """Replace the files; return notes on buffers of a replaced .gltf that it doesn't use any more."""
    target, notes = resolver.resolve_links(Path(path)), list[str]()
    if dry_run:
        staged.plan(target.parent)
        return ()
    if staged.main not in staged.names:  # a file a frame: a rule of the name itself would always be out of date
        command_files.add_output(path, os.path.join(os.path.dirname(path), min(staged.names)))
    spared = command_files.inputs_besides(target)
    with replace_text(target, spared, notes.append) if ending == ".gltf" else nullcontext():
        staged.commit()
    return tuple(notes)


def _ending(inputs: cache_folders.CacheFolder) -> str:
    """File extension of the input's format: by name, else by its first bytes or those of its first frame."""
    own = suffix(inputs.main)
    if own in CACHE_FORMATS:
        return own
    frames = () if inputs.main in inputs.names() else mesh_sequence.sequence_files(inputs.main, inputs.names())
    head, size = inputs.read_head(frames[0] if frames else inputs.main)
    try:
        return sniff_format(head, size)
    except FormatError:
        if own:
            return own  # which is then reported as unknown
        raise


def unsupported_notes(cache: VertexCache, ending: str) -> tuple[str, ...]:
    """Return notes on data of the cache that the format can't store."""
    carried = [name for name, has in (("normals", cache.has_normals), ("tangents", cache.has_tangents)) if has]
    lost = [name for name in carried if name not in CACHE_FORMATS[ending].holds]
    return (f"{' and '.join(lost)} are left out: {ending[1:]} has no place for them",) if lost else ()


def unwritable_note(names: Sequence[str]) -> tuple[str, ...]:
    """Return the note on the files that a pipe can't take."""
    return (f"not written, since the output is a pipe: {', '.join(names)}",) if names else ()


def orphan_warnings(path: str, written: Sequence[str], ending: str) -> tuple[str, ...]:
    """Return the warnings of frames of an earlier sequence beside those written to `path`."""
    if CACHE_FORMATS[ending].files is not Files.FRAMES:
        return ()
    target, there = resolver.resolve_links(Path(path)), []
    with suppress(OSError):
        there = os.listdir(target.parent)
    found = []
    if old := [name for name in mesh_sequence.sequence_files(target.name, there) if name not in written]:
        frames = plural(len(old), "frame")
        found.append(f"{frames} of before still there, from {old[0]} on: what reads the sequence reads them too")
    if target.name in there and target.name not in (*written, *old):
        found.append(f"{target.name} of before is still there, and is what that name reads")
    return tuple(found)
