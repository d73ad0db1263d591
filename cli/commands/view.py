"""`gltf-anim view`: a page that plays a file, or compares two."""

from __future__ import annotations

import time
from typing import Annotated

import numpy as np
import typer

from anim.errors import AnimError
from anim.gltf.reading import reader
from anim.measure.error.metric import ErrorMetric
from anim.operations.selection import Selection
from anim.show.page.comparison import compare_clips, compare_content
from anim.show.page.page import EMPTY, SHOWS, PageContent, PageFile, PageView, page
from anim.show.page.resources import read_script
from cli.errors import UsageError
from cli.io import browser, documents, scenes
from cli.io.page_files import open_page_file
from cli.options import common
from cli.text import Reporter, format_bytes, format_duration, format_length

PAGE_SUFFIXES = (".html", ".htm")


def command(
    input: Annotated[
        str,
        typer.Argument(
            metavar="IN",
            help="A glTF file, a vertex cache, or BVH, CSV or JSON curves; '-' for stdin.",
            show_default=False,
        ),
    ] = "-",
    other: Annotated[
        str | None, typer.Argument(metavar="[B]", help="File to compare with.", show_default=False)
    ] = None,
    *,
    output: Annotated[
        str | None,
        typer.Option("--out", "-o", metavar="NAME", help="The page to write, a .html file; without it, it is opened."),
    ] = None,
    clip: common.Clips = None,
    node: common.Nodes = None,
    at: Annotated[float | None, typer.Option("--at", metavar="S", help="Time in seconds to pause at.", min=0)] = None,
    show: Annotated[
        str | None,
        typer.Option("--show", metavar="NAME,...", help=f"Views that are on at first: {', '.join(SHOWS)}."),
    ] = None,
    title: Annotated[str | None, typer.Option("--title", metavar="TEXT", help="Title of the page.")] = None,
    quiet: common.Quiet = False,
) -> None:
    """Show a file as a page in the browser: play, scrub, look at curves; or compare two files.

    The page is one file without any network: it can be mailed, attached to a ticket, or kept as an artifact of CI.
    With B, both move side by side under one camera, the heat shows the distance of each vertex, and the largest error
    of each clip is a link. Press ? on the page for its keys; its address keeps clip, time, node and views.

    Without --out the page is opened in the browser, and leaves no file. --clip, --node, --at and --show choose what is
    seen first.
    """
    voice = Reporter(quiet)
    began = time.perf_counter()
    read_script()  # first: without it there is no page, whatever the input
    _check(input, other, output)
    shows = _shows(show)
    first = open_page_file(input, voice)
    second = None if other is None else open_page_file(other, voice)
    content = EMPTY if second is None else _compare(first, second, voice)
    view = _view(first, clip, node, at, shows)
    made = page(first, second, title=title or "", view=view, content=content)
    if output is None:
        if not browser.show_once(made):
            voice.warn("no browser came; -o page.html writes the page")
        return
    documents.write_bytes([np.frombuffer(made, np.uint8)], output)
    worst = max((each.max for each in content.errors.values()), default=0.0)
    words = f", max {format_length(worst)}" if content.errors else ""
    called = input if output == documents.PIPE else output
    voice.info(f"{called}  {format_bytes(len(made))}{words}, {format_duration(time.perf_counter() - began)}")


def _check(input: str, other: str | None, output: str | None) -> None:
    if input == other == documents.PIPE:
        raise UsageError("IN and B can't both be stdin")
    if output is None or output == documents.PIPE:
        return
    documents.check_file(output)
    if not output.lower().endswith(PAGE_SUFFIXES):
        raise UsageError(f"{output}: is no .html file (expected a name such as page.html)")


def _shows(show: str | None) -> tuple[str, ...]:
    names = tuple(name.strip() for name in (show or "").split(",") if name.strip())
    if unknown := [name for name in names if name not in SHOWS]:
        raise UsageError(f"--show has '{unknown[0]}' (expected some of {', '.join(SHOWS)})")
    return names


def _view(
    file: PageFile, clip: list[str] | None, node: list[str] | None, at: float | None, shows: tuple[str, ...]
) -> PageView:
    """View of the page when it opens: on the first clip and node that match."""
    selection = Selection(tuple(clip or ()), tuple(node or ()))
    clips, skeleton = reader.names(file.document), reader.skeleton(file.document)
    chosen_clip = reader.clip_name(clips[i], i) if clip and (i := selection.chosen_clips(clips)[0]) >= 0 else None
    chosen_node = skeleton.display_name(selection.chosen_nodes(skeleton)[0]) if node else None
    if chosen_node is not None and not shows:
        shows = ("curves",)
    return PageView(chosen_clip, chosen_node, at, shows)


def _compare(one: PageFile, other: PageFile, voice: Reporter) -> PageContent:
    """Errors over time, where both can be measured; else the page compares vertices by itself."""
    try:
        found = [scenes.read_scene(each.document, each.name, voice) for each in (one, other)]
        clips = reader.clips(one.document), reader.clips(other.document)
        ruler = ErrorMetric(*found)
        pairs = compare_clips(ruler, *clips)
    except AnimError as error:
        voice.info(f"note: without errors over time: {error}")
        return EMPTY
    return compare_content(ruler, *clips, pairs)
