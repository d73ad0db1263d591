"""Pages of `bake`, `convert-cache` and `diff`: a cache beside what it was made of, with errors vertex by vertex."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from anim.caches.registry import READABLE
from anim.caches.storage import suffix
from anim.errors import AnimError
from anim.gltf.reading import reader
from anim.measure.error.sample_times import FPS
from anim.operations.selection import Selection
from anim.show.page.comparison import vertex_content
from anim.show.page.page import PageFile, page
from cli.errors import UsageError
from cli.io import documents
from cli.io.cache_folders import StagedFolder
from cli.io.page_files import open_page_file, open_staged_file
from cli.io.page_output import check_page, commit_page_after
from cli.io.scenes import read_scene
from cli.reports.vertex_report import VertexReport
from cli.text import Reporter
from cli.workflows.page_comparison import compare_files, worst_view
from cli.workflows.vertex_diff import ComparedFile, diff_opened, open_compared


def check_cache_page(path: str | None, input: str, output: str, *, changed: Sequence[str] = ()) -> None:
    """Raise before any work if no page can show `output` beside `input`.

    path: of the page, None for none. changed: options given that put vertices elsewhere than those of `input`.
    """
    if path is None:
        return
    check_page(path, "--html")
    if documents.PIPE in (input, output):
        raise UsageError("--html shows IN beside OUT, which are read again (expected files, no '-')")
    if suffix(output) not in READABLE:
        raise UsageError(f"--html reads OUT again (expected one of {', '.join(READABLE)})")
    if changed:
        raise UsageError(f"--html compares vertices with those of IN (expected no {changed[0]})")


@contextmanager
def commit_cache_page_after(
    path: str, files: tuple[str, str], staged: StagedFolder, clip: Sequence[str], reporter: Reporter, *, dry_run: bool
) -> Iterator[None]:
    """Make the page of a file and its cache or bake, whose files the block renames, and write it after the block.

    files: the input and the output, which is read before that. clip: globs for the clip of the glTF file.
    An error leaves the files as they were.
    """
    old, new = files
    again = Reporter(quiet=True)  # for the input, whose notes the command has reported
    again.warnings = reporter.warnings
    one, other = open_page_file(old, again), open_staged_file(new, staged, reporter)
    try:
        with open_compared(old, again) as source:
            found = diff_opened(source, _compared(new, other, reporter), clip, FPS, reporter)
    except AnimError as error:
        reporter.info(f"note: {path}: without errors over time: {error}")
        found = None
    made = _vertex_page(one, other, clip, found, reporter)
    with commit_page_after(path, made, reporter, dry_run=dry_run):
        yield


def write_vertex_page(
    path: str, old: str, new: str, clip: Sequence[str], found: VertexReport | None, reporter: Reporter
) -> None:
    """Write the page of two files, of which one is a cache or a bake of the other. found: their distance."""
    one, other = open_page_file(old, reporter), open_page_file(new, reporter)
    with commit_page_after(path, _vertex_page(one, other, clip, found, reporter), reporter):
        pass


def _vertex_page(
    one: PageFile, other: PageFile, clip: Sequence[str], found: VertexReport | None, reporter: Reporter
) -> bytes:
    names = reader.names(one.document)
    chosen = Selection(tuple(clip)).chosen_clips(names) if clip and len(names) > 1 else []
    name = reader.clip_name(names[chosen[0]], chosen[0]) if len(chosen) else None
    content = compare_files(one, other, reporter, clip=name)
    if found is not None and content.partners:
        index = next(iter(content.partners))
        label = " · ".join(filter(None, (reader.clip_name(names[index], index), found.mesh)))
        content = vertex_content(content, found.found, clip=index, label=label)
    return page(one, other, view=worst_view(one, content), content=content)


def _compared(name: str, file: PageFile, reporter: Reporter) -> ComparedFile:
    """A page's file for the measurement of its vertices."""
    if file.cache is not None:
        return ComparedFile(name, file.size, None, file.cache)
    return ComparedFile(name, file.size, file.document, None, read_scene(file.document, name, reporter))
