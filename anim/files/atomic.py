"""Atomic output: files are written as temporary siblings and renamed when complete.

One file is replaced by one rename. Files related only by their names (a cache and its companions) cannot be: their main
file is moved away before any of them changes and is renamed last, so that a reader that finds it finds a consistent
set.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from anim.arrays import Bytes
from anim.errors import OutputError, not_written
from anim.files import guard, resolver, signals, special_files
from anim.files.folder_lock import lock_folder
from anim.files.stream import write_stream

MAX_PREFIX_LENGTH = 40  # characters of the target name in a temporary name, so that long names remain valid
BLOCK_BYTES = 1 << 24  # copied or compared at a time


def write_file(path: Path, pieces: Sequence[Bytes], *, in_place: bool = False) -> None:
    """Write one file atomically; for equal bytes only the modification time is updated.

    Links are followed; special files (/dev/null, a named pipe) are written directly, and so is what this process has
    open (/dev/stdout, also where it leads to a file): after what others wrote there. in_place: the file may be the
    input. Raises OutputError.
    """
    with commit_after(path, pieces, in_place=in_place):
        pass


@contextmanager
def commit_after(path: Path, pieces: Sequence[Bytes], *, in_place: bool = False) -> Iterator[None]:
    """Write one file like `write_file`, but rename it after the block; an error keeps the old file.

    So errors of this file (no permission, a full disk) are raised before the block. Other than regular files are
    written before it.
    """
    with stage(path, pieces, in_place=in_place) as commit:
        yield
        commit()


@contextmanager
def stage(path: Path, pieces: Sequence[Bytes], *, in_place: bool = False) -> Iterator[Callable[[], None]]:
    """Write one file as a temporary sibling, until the end of the block; give the function that renames it.

    Special files are written at once.
    """
    target, temporary = resolver.resolve_links(path), None
    is_special = special_files.is_special(path)

    def commit() -> None:
        guard.begin()
        with name_errors(path):
            if temporary is not None:
                os.replace(temporary, target)
            elif not is_special:
                os.utime(target)

    with temporary_files() as made:
        if is_special:
            guard.begin()
        guard.plan(path, in_place=in_place)
        with name_errors(path):
            if is_special:
                with special_files.open_special(path) as file:
                    write_stream(file, (piece.data for piece in pieces), str(path))
            else:
                check_writable(path)
                temporary = None if has_bytes(target, pieces) else write_temporary(target, pieces, made)
        yield commit


@dataclass
class AtomicOutputs:
    """Files of one folder, `main` and its companions, that are renamed together on `commit`.

    folder and main: with links resolved. A companion that is a link is replaced: its target belongs to others.
    suffix: of the name by which `main` is written, which can be a link's; None for its own.
    """

    folder: Path
    main: str
    files: dict[str, Path] = field(default_factory=dict)
    suffix: str | None = None

    def size(self, names: Sequence[str]) -> int:
        """Return the total bytes of these files."""
        return sum(self.files[name].stat().st_size for name in names)

    @property
    def names(self) -> tuple[str, ...]:
        """All files, the main one last."""
        return tuple(sorted(self.files, key=lambda name: name == self.main))

    def create(self, name: str) -> BinaryIO:
        """Return a new file of this name, open for writing and reading."""
        path = self.folder / name
        if special_files.is_special(path):  # companions of /dev/null would be in a shared folder
            path = Path(tempfile.gettempdir()) / name
        with signals.hold_signals():  # one in between would leave a file that nobody knows
            handle, self.files[name] = create_temporary(path)
        return os.fdopen(handle, "w+b")

    def plan(self, folder: Path) -> None:
        """Ask whether the files may be replaced; `folder` is that which they are for."""
        companions = [folder / name for name in self.names if name != self.main]
        guard.plan(folder / self.main, companions, in_place=True, suffix=self.suffix)

    def commit(self) -> None:
        """Rename the files that have new bytes; otherwise update the main file's time.

        Without the main file (a sequence of numbered frames) the first one replaces it.
        """
        import filecmp

        self.plan(self.folder)
        guard.begin()
        main = self.main if self.main in self.files else min(self.files)
        with lock_folder(self.folder):
            new = {}
            for name, temporary in self.files.items():
                path = self.folder / name
                if special_files.is_special(path):
                    with temporary.open("rb") as source, special_files.open_special(path) as target:
                        write_stream(target, iter(lambda: source.read(BLOCK_BYTES), b""), str(path))
                    continue
                check_writable(path)
                if not path.exists() or not filecmp.cmp(temporary, path, shallow=False):
                    copy_permissions(path, temporary)
                    new[path] = temporary
            _replace_set(new, self.folder / main)

    def clear(self) -> None:
        """Remove remaining temporary files."""
        for temporary in self.files.values():
            with suppress(OSError):
                temporary.unlink()


@contextmanager
def name_errors(path: Path) -> Iterator[None]:
    """Convert OSError to an error with the output's name."""
    try:
        yield
    except OSError as error:
        raise not_written(path, error) from None


@contextmanager
def temporary_files() -> Iterator[list[Path]]:
    """Yield a list of temporary files; those that remain at the end are removed."""
    made: list[Path] = []
    try:
        yield made
    finally:
        with signals.hold_signals():  # the signal must not interrupt the removal
            for path in made:
                with suppress(OSError):
                    path.unlink()


def write_temporary(path: Path, pieces: Iterable[Bytes], made: list[Path]) -> Path:
    """Write chunks to a temporary sibling of `path` with its permissions; return the temporary path.

    made: of `temporary_files`; receives the path on creation.
    """
    with signals.hold_signals():  # one in between would leave a file that nobody knows
        handle, temporary = create_temporary(path)
        made.append(temporary)
    with os.fdopen(handle, "wb") as file:
        file.writelines(piece.data for piece in pieces)
    copy_permissions(path, temporary)
    return temporary


def create_temporary(path: Path, suffix: str = ".tmp") -> tuple[int, Path]:
    """Create an empty sibling of `path` that will replace it; return its descriptor and path."""
    handle, name = tempfile.mkstemp(prefix=f".{path.name[:MAX_PREFIX_LENGTH]}.", suffix=suffix, dir=path.parent)
    return handle, Path(name)


def move_to_free(temporary: Path, path: Path) -> None:
    """Rename a temporary file to a free name, atomically. Raises FileExistsError otherwise."""
    try:
        os.link(temporary, path)
    except FileExistsError:
        raise
    except OSError:  # a file system without hard links: reserve the name with an empty file first
        os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
        try:
            os.replace(temporary, path)
        except BaseException:
            os.unlink(path)
            raise


def copy_permissions(path: Path, temporary: Path) -> None:
    """Give a temporary file the permissions of the file that it will replace, or of a new one.

    Also owner and group, as far as the system allows: root that writes over a file of others leaves it theirs.
    """
    if path.exists() and hasattr(os, "chown"):
        old, new = path.stat(), temporary.stat()
        if (old.st_uid, old.st_gid) != (new.st_uid, new.st_gid):
            with suppress(OSError):
                os.chown(temporary, old.st_uid, old.st_gid)
    os.chmod(temporary, mode_of(path))


def mode_of(path: Path) -> int:
    """Return the permissions of the existing or future file at `path`."""
    if path.exists():
        return path.stat().st_mode & 0o7777
    umask = os.umask(0)
    os.umask(umask)
    return 0o666 & ~umask


def check_writable(path: Path) -> None:
    """Raise OutputError for an existing file without write permission, and for links that lead to themselves."""
    if os.path.islink(resolver.resolve_links(path)) and not os.path.exists(path):
        raise OutputError(f"{path}: is a loop of links")
    if path.exists() and not os.access(path, os.W_OK):
        raise OutputError(f"{path}: is read-only")


def has_bytes(path: Path, pieces: Sequence[Bytes]) -> bool:
    """Return True if a regular file at `path` contains exactly these chunks."""
    if not path.is_file() or path.stat().st_size != sum(len(piece) for piece in pieces):
        return False
    with path.open("rb") as file:
        return all(
            file.read(min(BLOCK_BYTES, len(piece) - at)) == piece[at : at + BLOCK_BYTES].tobytes()
            for piece in pieces
            for at in range(0, len(piece), BLOCK_BYTES)
        )


def _replace_set(new: Mapping[Path, Path], main: Path) -> None:
    """Rename the temporary files `new` to their keys so that `main` never exists in a mixed set.

    Any error, or interruption other than SIGKILL, restores the old set.
    """
    with signals.hold_signals():
        if len(new) > 1:
            _replace_several(new, main)
        else:
            for path, temporary in new.items():
                os.replace(temporary, path)
        if main not in new and main.is_file():
            os.utime(main)


def _replace_several(new: Mapping[Path, Path], main: Path) -> None:
    companions = [path for path in new if path != main]
    old: dict[Path, Path] = {}
    placed: list[Path] = []
    with temporary_files() as made:
        try:
            for path in (main, *companions):
                if path.is_file():
                    handle, away = create_temporary(path, ".old")
                    os.close(handle)
                    made.append(away)
                    os.replace(path, away)
                    old[path] = away
            for path in companions:
                os.replace(new[path], path)
                placed.append(path)
            os.replace(new[main] if main in new else old[main], main)
        except BaseException:
            for path in placed:
                with suppress(OSError):
                    path.unlink()
            for path, away in old.items():
                with suppress(OSError):
                    os.replace(away, path)
            raise
