"""Patterns of paths: parts with wildcards, and "**" for any number of folders."""

from __future__ import annotations

from collections.abc import Iterator
from fnmatch import fnmatchcase
from functools import cache
from pathlib import PurePosixPath

ANY_FOLDERS = "**"


def matches(path: str, pattern: str) -> bool:
    """Return whether a path with "/" matches a pattern; "**" stands for any number of folders.

    Each part of the pattern is compared once with each of the path.
    """
    parts = PurePosixPath(path).parts
    return len(parts) in list(_matched_counts(parts, pattern))[-1]


def can_match_below(folder: str, pattern: str) -> bool:
    """Return whether a path below a folder, "" for the top one, can match a pattern."""
    parts = PurePosixPath(folder).parts
    states = zip(_pattern_parts(pattern), _matched_counts(parts, pattern), strict=False)
    return any(len(parts) in counts or (counts and part == ANY_FOLDERS) for part, counts in states)


def _matched_counts(parts: tuple[str, ...], pattern: str) -> Iterator[set[int]]:
    """Yield how many of the first parts of a path the first 0, 1, 2, … parts of a pattern match: all counts that do."""
    ends = {0}
    yield ends
    for each in _pattern_parts(pattern):
        if each == ANY_FOLDERS:
            ends = set(range(min(ends), len(parts) + 1)) if ends else ends
        else:
            ends = {end + 1 for end in ends if end < len(parts) and fnmatchcase(parts[end], each)}
        yield ends


@cache
def _pattern_parts(pattern: str) -> tuple[str, ...]:
    """The parts of a pattern, without a "**" behind another, which adds nothing."""
    parts = PurePosixPath(pattern).parts
    return tuple(part for part, before in zip(parts, ("", *parts), strict=False) if (part, before) != ("**", "**"))
