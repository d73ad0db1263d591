"""The format of a file without a name, by its first bytes and its size."""

from __future__ import annotations

from anim.caches.registry import CACHE_FORMATS
from anim.errors import FormatError

HEAD = 1024  # bytes that are enough for every signature


def sniff_format(head: bytes, size: int) -> str:
    """Return the file extension of a format by a file's first bytes (`HEAD`, if possible) and its size.

    Raises FormatError for bytes that no cache format starts with.
    """
    for ending, each in CACHE_FORMATS.items():
        if each.begins(head, size):
            return ending
    raise FormatError(f"starts with {head[:12]!r}, as no cache format does" if head else "is empty")
