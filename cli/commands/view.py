"""`gltf-anim view`: a page that plays a file, or compares two."""

from __future__ import annotations

import difflib
import time
from typing import Annotated

import numpy as np
import typer

from anim.errors import AnimError
from anim.gltf.reading import reader
from anim.operations.selection import Selection
from anim.show.page.page import EMPTY, SHOWS, START_VIEW, PageFile, PageView, page
from cli.errors import UsageError
from cli.io import browser, documents
from cli.io.page_files import open_page_file
from cli.io.page_output import check_page
from cli.options import common
from cli.text import Reporter, format_bytes, format_duration
from cli.workflows.page_comparison import compare_files, describe_worst, worst_view

BUTTONS = {"skeleton": "bones", "wireframe": "wire"}  # words of the page's buttons and key sheet


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
    of each clip is a link; the page begins at the largest of all. Press ? on the page for its keys; its address keeps
    clip, time, node and views.

    Without --out the page is opened in the browser, and leaves no file. --clip, --node, --at and --show choose what is
    seen first.
    """
    reporter = Reporter(quiet)
    began = time.perf_counter()
    if input == other == documents.PIPE:
        raise UsageError("IN and B can't both be stdin")
    if other is not None and other.endswith(".html"):
        raise UsageError(f"B is '{other}' (expected a file to compare with)", help=f"--out {other} writes the page")
    check_page(documents.PIPE if output is None else output)
    shows = _shows(show)
    first = open_page_file(input, reporter)
    second = None if other is None else open_page_file(other, reporter)
    view = _view(first, clip, node, at, shows)
    content = EMPTY
    if second is not None:
        content = compare_files(first, second, reporter, clip=view.clip)
        if view == START_VIEW:
            view = worst_view(first, content)
    made = page(first, second, title=title or "", view=view, content=content)
    if output is None:
        if not browser.show_once(made):
            reporter.warn("no browser came; -o page.html writes the page")
        return
    documents.write_bytes([np.frombuffer(made, np.uint8)], output)
    called = input if output == documents.PIPE else output
    parts = filter(None, (describe_worst(first, content), format_duration(time.perf_counter() - began)))
    reporter.info(f"{called}  {format_bytes(len(made))}, {', '.join(parts)}")


def _shows(show: str | None) -> tuple[str, ...]:
    names = tuple(name.strip() for name in (show or "").split(",") if name.strip())
    known = tuple(BUTTONS.get(name, name) for name in names)
    if unknown := [name for name in known if name not in SHOWS]:
        near = difflib.get_close_matches(unknown[0], SHOWS, n=1)
        help = f"did you mean '{near[0]}'?" if near else ""
        raise UsageError(f"--show has '{unknown[0]}' (expected some of {', '.join(SHOWS)})", help=help)
    return known


def _view(
    file: PageFile, clip: list[str] | None, node: list[str] | None, at: float | None, shows: tuple[str, ...]
) -> PageView:
    """View of the page when it opens: on the first clip and node that match."""
    selection = Selection(tuple(clip or ()), tuple(node or ()))
    try:
        clips, skeleton = reader.names(file.document), reader.skeleton(file.document)
        chosen_clip = reader.clip_name(clips[i], i) if clip and (i := selection.chosen_clips(clips)[0]) >= 0 else None
        chosen_node = f"#{selection.chosen_nodes(skeleton)[0]}" if node else None
    except AnimError as error:
        raise error.at(file.name, ": ") from None
    if chosen_node is not None and not shows:
        shows = ("curves",)
    return PageView(chosen_clip, chosen_node, at, shows)
