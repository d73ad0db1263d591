"""Cache of results by content: a record for each input with its steps, and the product by its own hash."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path, PurePosixPath

import numpy as np

from anim import __version__
from anim.arrays import Bytes
from anim.errors import OutputError
from anim.files import special_files
from cli.errors import UsageError
from cli.workflows.run import own_files
from cli.workflows.run.stamps import FileStatus, is_size, status_of
from cli.workflows.run.steps import MAKING, Step

NAME = ".gltf-anim-cache"  # of the default folder, beside the settings
FORMAT = 2
HASH = re.compile("[0-9a-f]{64}")
MAX_HASHED_BYTES = 1 << 32  # longest GLB; a hole in a file may be longer than can be read
KEEPING_FILES = frozenset({".gitignore", ".gitkeep"})  # by which git keeps a folder that is new otherwise
TAG_NAME = "CACHEDIR.TAG"
TAG = "Signature: 8a477f597d28d172789f06886806bc55\n# results of `gltf-anim run`: may be deleted\n"


@dataclass(frozen=True)
class CacheRecord:
    """Result of the steps on one content.

    product: hash of the GLB. size: its bytes. files: hash by path of the other files that were read. is_plain: whether
    the GLB has no external images, so that as an output it is one file of these bytes. step_errors: as in `JobResult`.
    """

    product: str
    size: int
    files: dict[str, str]
    is_plain: bool
    step_errors: Sequence[str] = ()

    def __post_init__(self) -> None:
        """Raise TypeError for values of other types."""
        is_hash = isinstance(self.product, str) and HASH.fullmatch(self.product)
        if not is_hash or not is_size(self.size) or type(self.is_plain) is not bool:
            raise TypeError("is no record of a result")
        if not isinstance(self.files, dict) or not all(isinstance(each, str) for each in self.files.values()):
            raise TypeError("has no hashes of files")
        if not isinstance(self.step_errors, (list, tuple)) or not all(isinstance(e, str) for e in self.step_errors):
            raise TypeError("has no errors of steps")


@dataclass
class FileHashes:
    """SHA-256 of files, each read once while it stays the same."""

    _known: dict[str, tuple[FileStatus, str]] = field(default_factory=dict)

    def hash(self, path: str) -> str:
        """Return the hash of a file, "" without one.

        That of what can't be read to its end (a device, a pipe, more than 4 GB) is equal to no other.
        """
        status = status_of(path)
        if status is None:
            return ""
        known = self._known.get(path)
        if known is None or known[0] != status:
            try:
                if status[0] > MAX_HASHED_BYTES:
                    raise OSError("is too long")
                with special_files.open_regular(path) as file:
                    known = status, hashlib.file_digest(file, "sha256").hexdigest()
            except OSError:
                return os.urandom(32).hex()
            self._known[path] = known
        return known[1]


@dataclass(frozen=True)
class ResultCache:
    """Folder of results. It may be deleted at any time; several runs may use it at once."""

    folder: Path

    def find(self, key: str, folder: Path, hashes: FileHashes) -> CacheRecord | None:
        """Return the record of a key if all files that its steps read are the same. folder: of relative paths."""
        try:
            record = CacheRecord(**json.loads(own_files.read(self._record(key))))
        except (OSError, ValueError, TypeError, RecursionError):  # none, or of another version
            return None
        same = all(hashes.hash(os.path.join(folder, path)) == digest for path, digest in record.files.items())
        return record if same else None

    def product(self, record: CacheRecord) -> Bytes | None:
        """Return the GLB of a record; None if it is lost or damaged."""
        try:
            data = np.frombuffer(own_files.read(self._object(record.product), MAX_HASHED_BYTES), np.uint8)
        except OSError:
            return None
        return data if hash_of(data) == record.product else None

    def store(
        self, key: str, product: Bytes, files: dict[str, str], *, is_plain: bool, step_errors: Sequence[str] = ()
    ) -> None:
        """Keep a result. Raises OutputError."""
        record = CacheRecord(hash_of(product), len(product), files, is_plain, tuple(step_errors))
        self._write(self._object(record.product), product)
        self._write(self._record(key), np.frombuffer(json.dumps(asdict(record)).encode(), np.uint8))

    def prepare(self) -> None:
        """Create the folder, ignored by git and by backups. Raises OutputError, also for links in it."""
        for folder in (self.results, self.objects):
            own_files.check_links(self.folder, folder)
        for name, text in ((TAG_NAME, TAG), (".gitignore", "*\n")):  # the tag first: see `check_named`
            if not (self.folder / name).exists():
                self._write(self.folder / name, np.frombuffer(text.encode(), np.uint8))

    def _write(self, path: Path, data: Bytes) -> None:
        own_files.write(self.folder, path, data)

    def mark_used(self, record: CacheRecord) -> None:
        """Set the time of a product, by which those that were not used for longest are found."""
        path = self._object(record.product)
        with suppress(OSError, OutputError):
            own_files.check_links(self.folder, path)
            os.utime(path)

    @property
    def results(self) -> Path:
        """Folder of the records."""
        return self.folder / "results"

    @property
    def objects(self) -> Path:
        """Folder of the products."""
        return self.folder / "objects"

    def _record(self, key: str) -> Path:
        return self.results / key[:2] / f"{key}.json"

    def _object(self, digest: str) -> Path:
        return self.objects / digest[:2] / digest


def check_named(folder: Path) -> None:
    """Raise UsageError for a folder, named by the user, that has files and is no cache: it may be the project's own."""
    try:
        names = os.listdir(folder)
    except OSError:  # none yet, or what an error is raised for when it is written
        return
    is_cache = KEEPING_FILES.issuperset(names)
    with suppress(OSError):
        is_cache = is_cache or b"gltf-anim run" in own_files.read(folder / TAG_NAME)
    if not is_cache:
        raise UsageError(f"--cache: '{folder}' has other files (expected a new folder, or a cache)")


def recipe_key(steps: tuple[Step, ...], folder: Path, hashes: FileHashes) -> str:
    """Return the hash of steps, of the files that their options name, and of the tool's version."""
    files = [hashes.hash(os.path.join(folder, path)) for step in steps for path in step.files]
    return _hash_json([FORMAT, __version__, [step.words() for step in steps], files])


def result_key(recipe: str, steps: tuple[Step, ...], path: str, digest: str) -> str:
    """Return the hash of a recipe on an input's content. path: of the input, whose name a new clip takes."""
    name = PurePosixPath(path).name if steps[0].command[0] in MAKING else ""
    return _hash_json([recipe, digest, name])


def path_key(key: str, path: str) -> str:
    """Return the key of a result that other files beside the input have a part in. path: of the input.

    Another input of the same content, in another folder, has its own buffers there.
    """
    return _hash_json([key, path])


def hash_of(data: Bytes) -> str:
    """Return the SHA-256 of bytes."""
    return hashlib.sha256(data.data).hexdigest()


def _hash_json(value: object) -> str:
    return hashlib.sha256(json.dumps(value).encode()).hexdigest()
