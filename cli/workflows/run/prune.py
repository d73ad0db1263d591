"""Size limit of a cache: the results that were not used for longest are deleted."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from cli.workflows.run.cache import ResultCache


def prune(cache: ResultCache, limit: int) -> tuple[int, int]:
    """Delete the products that were not used for longest until the others have at most `limit` bytes.

    Records of deleted products are deleted too. Return the numbers of deleted products and bytes. Files that another
    run deletes at the same time are skipped.
    """
    found = sorted(_files(cache.objects), key=lambda each: each[1].st_mtime_ns)
    left = sum(stat.st_size for _, stat in found)
    deleted: dict[str, int] = {}
    for path, stat in found:
        if left <= limit:
            break
        with suppress(OSError):
            path.unlink()
            deleted[path.name] = stat.st_size
        left -= stat.st_size
    if deleted:
        _delete_records(cache, deleted)
    return len(deleted), sum(deleted.values())


def _delete_records(cache: ResultCache, products: dict[str, int]) -> None:
    for path, _ in _files(cache.results):
        with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
            if json.loads(path.read_bytes())["product"] in products:
                path.unlink()


def _files(folder: Path) -> Iterator[tuple[Path, os.stat_result]]:
    for path in folder.glob("*/*"):
        with suppress(OSError):
            yield path, path.stat()
