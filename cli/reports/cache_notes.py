"""Notes on the written files of a vertex cache, a line each."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from anim.caches.formats import mesh_sequence
from anim.caches.registry import CACHE_FORMATS, Files
from anim.files import links
from anim.model import VertexCache
from cli import text


def unsupported_notes(cache: VertexCache, ending: str) -> tuple[str, ...]:
    """Return notes on data of the cache that the format can't store."""
    carried = [name for name, has in (("normals", cache.has_normals), ("tangents", cache.has_tangents)) if has]
    lost = [name for name in carried if name not in CACHE_FORMATS[ending].holds]
    return (f"{' and '.join(lost)} are left out: {ending[1:]} has no place for them",) if lost else ()


def unwritable_note(names: Sequence[str]) -> tuple[str, ...]:
    """Return the note on the files that a pipe can't take."""
    return (f"not written, since the output is a pipe: {', '.join(names)}",) if names else ()


def orphans_note(path: str, written: Sequence[str], ending: str) -> tuple[str, ...]:
    """Return the note on frames of an earlier sequence beside those written to `path`."""
    if CACHE_FORMATS[ending].files is not Files.FRAMES:
        return ()
    target, there = links.resolve_links(Path(path)), []
    with suppress(OSError):
        there = os.listdir(target.parent)
    notes = []
    if old := [name for name in mesh_sequence.sequence_files(target.name, there) if name not in written]:
        notes.append(f"{text.plural(len(old), 'frame')} of before still there, from {old[0]} on")
    if target.name in there and target.name not in (*written, *old):
        notes.append(f"{target.name} of before is still there, and is what that name reads")
    return tuple(notes)
