"""`gltf-anim diff`: distances between the motion of two files."""

from __future__ import annotations

from contextlib import ExitStack
from enum import StrEnum
from pathlib import PurePath
from typing import Annotated

import typer

from anim.errors import AnimError
from anim.gltf.io import container
from anim.gltf.reading import reader
from anim.measure.compare.diff import diff as compared
from anim.measure.compare.equal_scenes import store_alike
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.sample_times import FPS
from anim.measure.error.surface import diagonal, is_measured_at, reference_length
from anim.operations.selection import Selection
from anim.sampling.players import PLAYERS, parse_pair
from anim.units import is_zero
from cli import units
from cli.errors import CheckError, UsageError
from cli.io import documents
from cli.options import common
from cli.options.common import Format
from cli.reports import diff_report, vertex_report
from cli.reports.diff_report import DiffReport
from cli.reports.vertex_report import VertexReport
from cli.text import Reporter, format_bytes, format_length
from cli.workflows.diff_side import DiffSide, ambiguous_clips, are_bake_and_source, common_names, open_side

Player = StrEnum("Player", [(name, name) for name in PLAYERS])  # type: ignore[misc]
SPEC = Player("spec")


def command(
    old: Annotated[
        str, typer.Argument(metavar="A", help="A .glb or .gltf file, or a cache; '-' for stdin.", show_default=False)
    ],
    new: Annotated[
        str | None,
        typer.Argument(metavar="[B]", help="File to compare with; none with --players.", show_default=False),
    ] = None,
    *,
    format: common.Report = Format.TEXT,
    plot: Annotated[
        str | None, typer.Option("--plot", metavar="OUT", help="Plot the error over time: a .png or .svg file.")
    ] = None,
    fail_above: Annotated[
        str | None,
        typer.Option(
            "--fail-above",
            metavar="LENGTH",
            help="Maximum error, above it exit 6: 0.5mm, or 0.1% of the model's size; 0: no error, also of "
            "weights and pointers.",
        ),
    ] = None,
    player: Annotated[
        Player,
        typer.Option("--player", help="; ".join(f"{name}: {each.about}" for name, each in PLAYERS.items()) + "."),
    ] = SPEC,
    players: Annotated[
        str | None,
        typer.Option("--players", metavar="P,Q", help="Two players to compare on one file, without B: spec,nlerp."),
    ] = None,
    fps: Annotated[
        float, typer.Option("--samples-per-second", metavar="N", help="Samples per second, in addition to all keys.")
    ] = FPS,
    html: common.Html = None,
    shell: Annotated[
        str,
        typer.Option(
            "--shell",
            metavar="LENGTH",
            help="Distance from nodes without vertices at which their error is measured; 0: ignore such nodes.",
        ),
    ] = "1%",
    clip: common.Clips = None,
    quiet: common.Quiet = False,
) -> None:
    """Measure the difference between the motion of two files, in metres on the surface.

    Clips and nodes are matched by name, then by order, with a warning if no name is common. A's vertices are moved by
    the nodes of both files, so that quantized, merged or reordered meshes do not count as motion. Nodes that move no
    vertex are measured at six points around them (--shell). Errors are measured at all keys of both files, half-way
    between, and at 120 samples per second.

    Per clip, worst first: the largest error with joint, vertex and time; p99 and mean over all vertices; the largest
    rotation error of a node in world space; the largest error of speed (jitter), of morph weights, and of pointers (as
    a fraction of their range); end times that differ; the number of tracks that only A (−) or only B (+) has.

    A bake with its source, and caches (.npz, .pc2, .usdc …), are compared by vertex: B has the vertices of A in their
    order, in world space; if A has several clips, --clip selects one.

    --fail-above also fails if B lacks a clip, and if there is no clip to compare. --player interpolates as other
    players do, which differs for keys that are not of unit length. --players spec,nlerp compares one file in two
    players.
    """
    reporter, selection = Reporter(quiet), Selection(clip or ())
    units.warn_without_unit(fail_above, "--fail-above", reporter.warn)
    who = _players(new, str(player), players)
    if old == new == documents.PIPE:
        raise UsageError("A and B can't both be stdin")
    if fps <= 0:
        raise UsageError(f"--samples-per-second is {fps:g} (expected a number above 0)")
    if plot is not None:
        from cli.workflows.diff_plot import check_plot, draw_errors

        kind = check_plot(plot)
    if html is not None:
        from cli.io.page_output import check_page  # imports readers of all formats, as in the functions below

        check_page(html, "--html")
        if new is None or player is not SPEC:
            raise UsageError("--html shows two files as glTF specifies (expected neither --player nor --players)")
    one = other = None
    if not (_is_cache(old) or _is_cache(new)):
        one = open_side(old, reporter)
        other = one if new is None else open_side(new, reporter)
        first, second = store_alike(one.scene, other.scene)
        one, other = one._replace(scene=first), other._replace(scene=second)
    if new is not None and (one is None or other is None or are_bake_and_source(one, other)):
        if plot is not None or player is not SPEC:
            raise UsageError(f"{'--plot' if plot is not None else '--player'} does not apply to caches and bakes")
        from cli.workflows.vertex_diff import compare_document, diff_by_vertex

        opened = {
            side.file.name: compare_document(side.file.name, side.file.size, side.document, side.scene.store_repeats())
            for side in (one, other)
            if side is not None
        }
        found_by_vertex = diff_by_vertex(old, new, clip or (), fps, reporter, opened=opened)
        words = _vertex_words(found_by_vertex, format, reporter, quiet=quiet)
        if html is not None:
            from cli.workflows.cache_page import write_vertex_page

            write_vertex_page(html, old, new, clip or (), found_by_vertex, reporter)
        if words:
            documents.write_text(words)
        _check_vertices(found_by_vertex, fail_above)
        return
    assert one is not None
    assert other is not None
    scale = diagonal(one.scene)
    limit = None if fail_above is None else _length(fail_above, "--fail-above", scale)
    radius = _length(shell, "--shell", reference_length(scale))
    ruler = ErrorMetric(one.scene, other.scene, shell=radius or None, clips=(*one.clips, *other.clips))
    chosen = selection.chosen_clips(one.file.clips) if clip else None
    try:
        jsons = one.document.json, other.document.json
        found = compared(ruler, one.clips, other.clips, chosen=chosen, player=who, fps=fps, documents=jsons)
    except AnimError as error:
        raise error.at(one.file.name, ": ") from None
    alone = None
    if found.clips and found.clips[0].error.is_around_node:  # so that the line has the figure that edits state, too
        bare = ErrorMetric(one.scene, other.scene, clips=(*one.clips, *other.clips))
        pairs = compared(bare, one.clips, other.clips, chosen=chosen, player=who, fps=fps).clips
        alone = max(each.error.max_error for each in pairs)
    report = DiffReport(
        one.file, other.file, found, *common_names(one, other), who, fps, radius, is_measured_at(one.scene), alone
    )
    if report.warning:
        reporter.warn(report.warning)
    for words in ambiguous_clips(one.file, other.file, chosen):
        reporter.warn(words)
    for words in () if report.are_strangers else found.warnings:
        reporter.warn(f"{other.file.name}: {words}")
    if format is Format.JSON:
        words = diff_report.as_json(report, warnings=reporter.warnings)
    else:
        words = "" if quiet else diff_report.text(report)
    with ExitStack() as stack:  # one output that fails leaves the files as they were
        if plot is not None:
            drawn = draw_errors(report, ruler, one.clips, other.clips, kind=kind, limit=limit)
            stack.enter_context(documents.commit_text_after(drawn, plot))
        if words:
            documents.write_text(words)
        if html is not None:
            assert new is not None
            _write_page(html, report, ruler, (old, one), (new, other), reporter)
    if plot is not None:
        reporter.info(f"{plot}  {format_bytes(len(drawn))}")
    if limit is not None:
        _check(report, limit)


def _write_page(
    path: str,
    report: DiffReport,
    ruler: ErrorMetric,
    one: tuple[str, DiffSide],
    other: tuple[str, DiffSide],
    reporter: Reporter,
) -> None:
    """Write the page of both files, with the table of clips."""
    from anim.show.page.comparison import ClipPair, compare_content
    from cli.io.page_output import page_file, write_page
    from cli.workflows.page_comparison import worst_view

    pairs = [ClipPair(each.old, each.new, each.error, each.statistics.p99) for each in report.diff.clips]
    content = compare_content(ruler, one[1].clips, other[1].clips, pairs)
    files = [page_file(name, side.document, side.file.size) for name, side in (one, other)]
    write_page(path, files[0], files[1], reporter, content=content, view=worst_view(files[0], content))


def _is_cache(path: str | None) -> bool:
    """Return whether a path has the file extension of a cache that is no glTF."""
    if PurePath(path or "").suffix.lower() in ("", *container.SUFFIXES):
        return False
    from cli.workflows.vertex_diff import is_cache  # imports all cache formats

    return is_cache(path)


def _vertex_words(report: VertexReport, format: Format, reporter: Reporter, *, quiet: bool) -> str:
    """The report of caches and bakes, "" for none."""
    if format is Format.JSON:
        return vertex_report.as_json(report, warnings=reporter.warnings)
    return "" if quiet else vertex_report.text(report)


def _check_vertices(report: VertexReport, fail_above: str | None) -> None:
    """Raise CheckError if a vertex of caches and bakes is farther away than the limit."""
    limit = None if fail_above is None else _length(fail_above, "--fail-above", report.found.diagonal)
    if limit is not None and report.found.max_error > limit:
        worst = f"{format_length(report.found.max_error)} at vertex {report.vertex}, {report.found.time:.3f} s"
        raise CheckError(f"{report.names[1]}: {worst} (limit {format_length(limit)})")


def _length(text: str, option: str, scale: float) -> float:
    """A length in m, also 0."""
    return 0.0 if is_zero(text) else units.parse_length(text, option, lambda: scale)


def _players(new: str | None, player: str, players: str | None) -> str:
    """Player name: one for both files, or two for one file."""
    if players is None:
        if new is None:
            raise UsageError("B is missing (expected two files, or one and --players spec,nlerp)")
        return player
    if new is not None or player != SPEC:
        raise UsageError("--players is about one file (expected neither B nor --player)")
    first, second = parse_pair(players)
    if first == second:
        raise UsageError(f"--players is '{players}' (expected two different ones of {', '.join(PLAYERS)})")
    return players


def _check(found: DiffReport, limit: float) -> None:
    """Raise CheckError if an error exceeds `limit` m, a clip is missing, or nothing was compared.

    With a limit of 0 also for any error of morph weights or pointers, which have no length, and for those not measured.
    """
    if found.diff.missing_clips:
        number = found.diff.missing_clips[0]
        raise CheckError(f"{found.new.name}: {reader.clip_label(found.old.clips[number], number)} is missing")
    if not found.diff.clips:
        raise CheckError(f"{found.old.name}, {found.new.name}: no clips to compare")
    above = [each for each in found.diff.clips if each.error.max_error > limit]
    if above:
        more = f" and {len(above) - 1} more" if len(above) > 1 else ""
        raise CheckError(f"{found.new.name}: {diff_report.worst(found)}{more} (limit {format_length(limit)})")
    if not limit and (words := diff_report.without_length(found)):
        raise CheckError(f"{found.new.name}: {words} (limit 0 mm)")
