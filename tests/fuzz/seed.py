"""A sound input of the fuzzers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Seed:
    """A sound input: its main file, all files, those that are mutated, and its command lines."""

    main: str
    files: Mapping[str, bytes]
    mutated: Sequence[str]
    lines: Sequence[str]
