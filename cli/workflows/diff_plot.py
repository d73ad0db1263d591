"""Plot of the errors of `diff` over time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath

from anim.gltf.reading import reader
from anim.measure.error.error_curve import error_curve
from anim.measure.error.metric import ErrorMetric
from anim.model import Clip
from anim.show.plots import error_plot as picture
from anim.show.plots.figure import FORMATS
from anim.units import plural
from cli.errors import UsageError
from cli.io import documents
from cli.reports.diff_report import DiffReport


def check_plot(path: str) -> str:
    """Return the format of a plot. Raises UsageError for another one, OutputError if it can't be written."""
    ending = PurePath(path).suffix.lower().lstrip(".")
    if ending not in FORMATS:
        raise UsageError(f"{path}: --plot writes .png or .svg")
    documents.check_file(path)
    return ending


def draw_errors(
    report: DiffReport,
    ruler: ErrorMetric,
    old: Sequence[Clip],
    new: Sequence[Clip],
    *,
    kind: str,
    limit: float | None,
) -> bytes:
    """Return the plot of the worst clips. kind: "png" or "svg". limit: m, a line in it."""
    apart = [each for each in report.diff.clips if each.error.max_error >= picture.MIN_ERROR_M]
    profiles = [
        error_curve(ruler, old[each.old], new[each.new], player=report.player, fps=report.fps)._replace(
            name=reader.clip_name(each.name, each.old),
        )
        for each in apart[: picture.LIMIT]
    ]
    note = _left_out(len(profiles), len(apart), len(report.diff.clips))
    names = [PurePath(each.name).name for each in (report.old, report.new)]
    title = " → ".join(names if names[0] != names[1] else (report.old.name, report.new.name))
    if "," in report.player:
        title = f"{PurePath(report.old.name).name}: {report.player.replace(',', ' → ')}"
    return picture.error_plot(profiles, title=title, kind=kind, limit=limit, note=note)


def _left_out(drawn: int, apart: int, count: int) -> str:
    """Number of clips drawn of those that differ, and number of clips that don't."""
    shown = (
        f"the worst {drawn} of {apart} clips that differ"
        if drawn < apart
        else f"{plural(apart, 'clip')} that differ{'s' if apart == 1 else ''}"
    )
    return f"{shown}, {count - apart} without difference" if count > apart else shown
