"""Curve of the size of animations against the error bound: on stderr, as CSV or as a picture."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import PurePath

from anim.errors import NotFoundError
from anim.measure.inspect.storage_cost import animation_bytes
from anim.optimization.file_optimizer import FileOptimizer
from anim.optimization.options import Request
from anim.optimization.rate_distortion import ERROR_FRACTIONS, MAX_BOUND_PER_DIAGONAL, RatePoint, check_diagonal, curve
from anim.units import format_number
from cli.errors import UsageError
from cli.io import documents
from cli.text import Reporter, format_bytes, format_length


def check_curve_file(path: str) -> None:
    """Raise UsageError for a file that is no table or picture, FileError for one that can't be written."""
    documents.check_file(path)
    if PurePath(path).suffix.lower() not in (".csv", ".png", ".svg"):
        raise UsageError(f"{path}: is no .csv, .png or .svg file")


def write_curve(
    optimizer: FileOptimizer, request: Request, path: str, name: str, reporter: Reporter, *, dry_run: bool
) -> None:
    """Search with one bound after another, report each size, and write the curve.

    request: with the effort that the sizes are of. name: of the file, for the title. Raises NotFoundError without
    channels, whose size no bound would change.
    """
    if not any(optimizer.clips[i].tracks for i in optimizer.chosen):
        raise NotFoundError("has no animation, whose size the curve would show")
    check_diagonal(optimizer.scale)
    reporter.info(f"  sizes of --effort {request.effort}")
    points = []
    bounds = (0.0, *ERROR_FRACTIONS, MAX_BOUND_PER_DIAGONAL)  # also the lossless and the smallest size
    for point in curve(optimizer.scale, lambda max_error: optimizer.find_point(request, max_error), bounds):
        reporter.info(_line(point, optimizer.scale))
        points.append(point)
    made = _render(points, optimizer, request.effort, PurePath(name).name, PurePath(path).suffix.lower()[1:])
    if not dry_run:
        documents.write_text(made, path)


def _render(points: Sequence[RatePoint], optimizer: FileOptimizer, effort: str, name: str, kind: str) -> str | bytes:
    if kind == "csv":
        return _csv(points, optimizer.scale)
    from anim.show.plots.rate_distortion_plot import rate_distortion_plot

    source = animation_bytes(optimizer.document)
    title = f"{name}, effort {effort}"
    return rate_distortion_plot(points, optimizer.scale, title=title, kind=kind, source=source)


def _line(point: RatePoint, scale: float) -> str:
    percent = 100 * point.max_error / scale if scale else 0.0
    bound = f"{format_length(point.max_error)} ({format_number(percent, 2)} %)" if point.max_error else "without loss"
    sizes = f"animation {format_bytes(point.animation)}, file {format_bytes(point.size)}"
    return f"  {bound}: {sizes}, max {format_length(point.error)}"


def _csv(points: Sequence[RatePoint], scale: float) -> str:
    """Return the curve as CSV.

    Columns: bound in metres and as a fraction of the diagonal, bytes of the file, largest measured error, and bytes of
    the animation alone.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["max_error_m", "share_of_diagonal", "bytes", "error_m", "animation_bytes"])
    for each in points:
        fraction = each.max_error / scale if scale else 0.0
        writer.writerow([each.max_error, fraction, each.size, each.error, each.animation])
    return text.getvalue()
