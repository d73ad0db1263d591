"""`gltf-anim collapse`: collapse and volume loss of linear skinning, compared with other methods."""

from __future__ import annotations

from pathlib import PurePath
from typing import Annotated

import numpy as np
import typer

from anim.errors import NotFoundError
from anim.gltf.reading import reader
from anim.measure.equal_clips import first_equal
from anim.measure.error.sample_times import grid_times
from anim.operations.selection import Selection
from anim.show.plots.collapse_plot import collapse_plot
from anim.skinning.analysis.collapse import Comparison, MeshCollapse
from anim.skinning.analysis.recommendations import CollapseFinding
from cli.errors import UsageError
from cli.io import documents, scenes
from cli.options import common, meshes
from cli.options.common import Format
from cli.options.meshes import Method
from cli.progress import Progress, announce_compiling
from cli.reports import collapse_report
from cli.reports.collapse_report import CollapseReport
from cli.text import Reporter, format_bytes

USUAL = ("lbs", "dqs")


def command(
    input: common.Input = "-",
    *,
    method: Annotated[
        list[Method] | None,
        typer.Option("--method", help="Skinning method to compare; may be repeated.  [default: lbs, dqs]"),
    ] = None,
    bulge_clamp: Annotated[
        bool, typer.Option("--bulge-clamp", help="Apply the bulge clamp of bake to methods other than lbs.")
    ] = False,
    fps: Annotated[
        float,
        typer.Option("--samples-per-second", metavar="N", help="Samples per second; of clips of many minutes fewer."),
    ] = 30,
    clip: common.Clips = None,
    mesh: meshes.Meshes = None,
    format: common.Report = Format.TEXT,
    plot: Annotated[
        str | None, typer.Option("--plot", metavar="OUT", help="Plot index and volume over time: a .png or .svg file.")
    ] = None,
    quiet: common.Quiet = False,
    verbose: Annotated[
        bool, typer.Option("--verbose", "-v", help="List every mesh, not only the worst one of each clip.")
    ] = False,
) -> None:
    """Find where skin collapses as joints twist and bend, and compare skinning methods.

    The collapse index is the fraction of the radius around a vertex that linear blend skinning preserves: 1 for a rigid
    motion, 0.71 for a rotation of 90° between two joints, 0 for a candy wrapper. It needs no closed mesh. For closed
    parts of a mesh, the volume enclosed by each method is compared with that of the bind pose. Bulge is the largest
    distance of a vertex from the segments between its joints, relative to the bind pose.

    A clip collapses if an index is below 0.7, or if linear blend skinning preserves less than 90 % of the volume and
    another method preserves more. Recommendations follow the table.
    """
    _check(fps, plot)
    reporter = Reporter(quiet)
    methods = tuple(dict.fromkeys(str(each) for each in method)) if method else USUAL
    found: list[CollapseFinding] = []
    with documents.source(input, reporter) as source:
        document = source.document
        clips = reader.clips(document)
        scene = scenes.read_scene(document, source.name, reporter, nodes=lambda scene: meshes.nodes(scene, mesh))
        numbers = Selection(clip or ()).chosen_clips(reader.names(document))
        if plot is not None and not numbers:
            raise NotFoundError("there is no clip to draw")
        announce_compiling(Reporter(quiet))
        comparison = Comparison(scene, methods=methods, bulge_clamp=bulge_clamp, nodes=meshes.nodes(scene, mesh))
        progress = Progress("collapse", len(numbers), shown=not quiet)
        by_clip: list[tuple[MeshCollapse, ...]] = []
        for done, (i, first) in enumerate(zip(numbers, first_equal([(clips[i],) for i in numbers]), strict=True)):
            if first == done:
                by_clip.append(comparison.of(clips[i], times=grid_times(clips[i], fps=fps, start=clips[i].start)))
            else:  # equal to an earlier clip
                by_clip.append(by_clip[first])
            found += [CollapseFinding(i, reader.clip_name(clips[i].name, i), each) for each in by_clip[-1]]
            progress(done + 1)
        progress.close()
    seen = CollapseReport(source.name, comparison.meshes, methods, bulge_clamp, fps, found, reporter.warnings)
    if format is Format.JSON:
        words = collapse_report.as_json(seen)
    else:
        words = "" if quiet else collapse_report.text(seen, every=verbose)
    if plot is not None:  # with a report that is complete: without it the picture stays as it was
        _draw(seen, plot, reporter)
    if words:
        documents.write_text(words)


def _check(fps: float, plot: str | None) -> None:
    if fps <= 0:
        raise UsageError(f"--samples-per-second is {fps:g} (expected a number above 0)")
    if plot is not None:
        documents.check_file(plot)
        if PurePath(plot).suffix.lower() not in (".png", ".svg"):
            raise UsageError(f"{plot}: is no .png or .svg file")


def _draw(seen: CollapseReport, plot: str, reporter: Reporter) -> None:
    title = PurePath(seen.name).stem + (", bulge clamp" if seen.clamped else "")
    picture = collapse_plot(
        collapse_report.worst_of_clips(seen.found), title=title, kind=PurePath(plot).suffix.lower()[1:]
    )
    documents.write_bytes([np.frombuffer(picture, np.uint8)], plot)
    reporter.info(f"{plot}  {format_bytes(len(picture))}")
