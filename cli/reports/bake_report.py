"""Summary and notes of the files that `bake` wrote."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePath

from anim.gltf.reading.reader import quote_clip
from anim.units import list_some, plural
from cli import text
from cli.io import documents
from cli.io.cache_files import SavedCache
from cli.text import Reporter


@dataclass(frozen=True, slots=True)
class BakedFile:
    """One clip baked into a file. number: index of the clip. group: index of the mesh group."""

    file: str
    clip: str
    number: int | None
    group: int
    frames: int
    vertices: int
    saved: SavedCache


def report_written(done: Sequence[BakedFile], reporter: Reporter, *, dry_run: bool) -> None:
    """Report the files already written when a later one fails."""
    if done and not dry_run:
        names = list_some([each.file for each in done])
        reporter.info(f"note: {plural(len(done), 'file')} written before: {names}")


def report_notes(done: Sequence[BakedFile], reporter: Reporter) -> None:
    """Report warnings, and every note once, with its files unless it applies to all."""
    for words in dict.fromkeys(words for each in done for words in each.saved.orphans):
        reporter.warn(words)
    files: dict[str, list[str]] = {}
    for each in done:
        for note in each.saved.written.notes:
            files.setdefault(note, []).append(PurePath(each.file).name)
    for note, names in files.items():
        where = f"{list_some(names)}: " if len(names) < len(done) else ""
        reporter.info(f"note: {where}{note}")


def summarize_files(done: Sequence[BakedFile], method: str) -> str:
    """Return the summary of baked files."""
    file = "stdout" if done[0].file == documents.PIPE else done[0].file
    name = file if len(done) == 1 else f"{_count(done)}, {file} …"
    frames = plural(sum(each.frames for each in done), "frame")
    first = done[0]
    is_one = len({each.number for each in done}) == 1 and first.number is not None
    of = f" of {quote_clip(first.clip, first.number or 0)}" if is_one else ""
    parts = [f"{name}  {text.format_bytes(sum(each.saved.size for each in done))}", f"{method}{of}"]
    vertices = sorted({each.vertices for each in done})
    parts.append(f"{frames} of {' to '.join(map(str, dict.fromkeys((vertices[0], vertices[-1]))))} vertices")
    errors = [each.saved.written.max_error for each in done if each.saved.written.max_error is not None]
    parts += [f"max {text.format_length(max(errors))} at frames"] if errors else []
    count = sum(len(each.saved.files) for each in done)
    return ", ".join([*parts, *([plural(count, "file")] if count > len(done) else [])])


def _count(done: Sequence[BakedFile]) -> str:
    """Return "2 clips", "2 meshes", or "2 meshes of 3 clips"."""
    clips, meshes = plural(len({each.number for each in done}), "clip"), len({each.group for each in done})
    if meshes == 1:
        return clips
    return f"{meshes} meshes of {clips}"
