"""Pages of `bake`, `convert-cache` and `diff`: a cache beside what it was made of, with errors vertex by vertex."""

from __future__ import annotations

from collections.abc import Sequence

from anim.caches.registry import READABLE
from anim.caches.storage import suffix
from anim.errors import AnimError
from anim.gltf.reading import reader
from anim.measure.error.sample_times import FPS
from anim.operations.selection import Selection
from anim.show.page.comparison import vertex_content
from cli.errors import UsageError
from cli.io import documents
from cli.io.page_files import open_page_file
from cli.io.page_output import check_page, write_page
from cli.reports.vertex_report import VertexReport
from cli.text import Reporter
from cli.workflows.page_comparison import compare_files, worst_view
from cli.workflows.vertex_diff import diff_by_vertex


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


def write_cache_page(path: str, old: str, new: str, clip: Sequence[str], reporter: Reporter) -> None:
    """Write the page of two files, of which one is a cache or a bake of the other, and measure their distance.

    clip: globs for the clip of the glTF file.
    """
    try:
        found = diff_by_vertex(old, new, clip, FPS, reporter, opened={})
    except AnimError as error:
        reporter.info(f"note: {path}: without errors over time: {error}")
        found = None
    write_vertex_page(path, old, new, clip, found, reporter)


def write_vertex_page(
    path: str, old: str, new: str, clip: Sequence[str], found: VertexReport | None, reporter: Reporter
) -> None:
    """Write the page of two files, of which one is a cache or a bake of the other. found: their distance."""
    one, other = open_page_file(old, reporter), open_page_file(new, reporter)
    names = reader.names(one.document)
    chosen = Selection(tuple(clip)).chosen_clips(names) if clip and len(names) > 1 else []
    name = reader.clip_name(names[chosen[0]], chosen[0]) if len(chosen) else None
    content = compare_files(one, other, reporter, clip=name)
    if found is not None and content.partners:
        index = next(iter(content.partners))
        label = " · ".join(filter(None, (reader.clip_name(names[index], index), found.mesh)))
        content = vertex_content(content, found.found, clip=index, label=label)
    write_page(path, one, other, reporter, content=content, view=worst_view(one, content))
