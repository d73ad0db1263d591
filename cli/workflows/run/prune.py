"""Size limit of a cache: the results that were not used for longest are deleted."""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from cli.workflows.run import own_files
from cli.workflows.run.cache import HASH, ResultCache


def prune(cache: ResultCache, limit: int) -> tuple[int, int]:
    """Delete the products that were not used for longest until the others have at most `limit` bytes.

    Records of deleted products are deleted too. Return the numbers of deleted products and bytes. Files that another
    run deletes at the same time are skipped.
    """
    found = sorted(_files(cache.objects), key=lambda each: each[1].st_mtime_ns)
    left = sum(each.st_size for _, each in found)
    deleted: dict[str, int] = {}
    for path, each in found:
        if left <= limit:
            break
        with suppress(OSError):
            path.unlink()
            deleted[path.name] = each.st_size
        left -= each.st_size
    if deleted:
        _delete_records(cache, deleted)
    return len(deleted), sum(deleted.values())


def _delete_records(cache: ResultCache, products: dict[str, int]) -> None:
    for path, _ in _files(cache.results):
        with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
            if json.loads(own_files.read(path))["product"] in products:
                path.unlink()


def _files(folder: Path) -> Iterator[tuple[Path, os.stat_result]]:
    """Regular files of a cache's own names: a folder that the user names may have others."""
    if folder.is_symlink():
        return
    for path in folder.glob("*/*"):
        name, above = path.name.removesuffix(".json"), path.parent
        with suppress(OSError):
            if HASH.fullmatch(name) and above.name == name[:2] and not above.is_symlink():
                found = path.lstat()
                if stat.S_ISREG(found.st_mode):
                    yield path, found
