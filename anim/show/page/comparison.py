"""Errors between two files for a page: over time, and the largest one of each clip as a link."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from anim.arrays import Floats
from anim.gltf.reading.reader import clip_name
from anim.measure.compare.name_matching import match_by_name_then_order
from anim.measure.compare.vertex_distance import VertexDistance
from anim.measure.error.error_curve import ErrorCurve, error_curve
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.motion_error import MotionError
from anim.measure.error.surface import has_vertices
from anim.model import Clip
from anim.show.page.page import ClipError, PageContent, PageLink, PagePanel, PageRow
from anim.show.page.paired_meshes import pair_nodes
from anim.units import format_number

MAX_POINTS = 400  # of an error curve on the page
MAX_CURVES = 100  # clips with an error curve, the worst ones
CURVE_FPS = 24.0  # of error curves, besides all keys and the middles between them
MIN_ERROR_PER_DIAGONAL = 1e-7  # smaller errors come from rounding in float32
VERTICES_MEASURED = (
    "Distances of vertices. diff also measures a small shell around nodes that move no vertex, and may report more."
)
NODES_MEASURED = "Distances of small cubes on the nodes, since A has no vertices."
SHELL_MEASURED = (
    "Distances of vertices and, as diff measures them, of a small shell around nodes that move no vertex. "
    "Heat and ring show vertices only, and may be less."
)
BAKE_MEASURED = (
    "Distances of vertices, also between frames, where bakes and caches are interpolated: "
    "a bake with more frames per second lessens these. 99 % of all are below p99."
)
UNITS = ((1.0, "m", 1.0), (1e-2, "cm", 1e2), (1e-4, "mm", 1e3), (1e-7, "µm", 1e6), (0.0, "nm", 1e9))


@dataclass(frozen=True, slots=True)
class ClipPair:
    """A clip of each file by index, the largest distance between both, and, in m, that of 99 % of all samples."""

    old: int
    new: int
    error: MotionError
    p99: float | None = None


def compare_clips(ruler: ErrorMetric, old: Sequence[Clip], new: Sequence[Clip]) -> list[ClipPair]:
    """Return the largest distance between each old clip and its counterpart, matched by name, then by order."""
    partners = match_by_name_then_order([clip.name for clip in old], [clip.name for clip in new])
    matched = [(i, int(partner)) for i, partner in enumerate(partners.tolist()) if partner >= 0]
    return [ClipPair(i, j, ruler.error(old[i], new[j])) for i, j in matched]


def compare_content(
    ruler: ErrorMetric,
    old: Sequence[Clip],
    new: Sequence[Clip],
    pairs: Iterable[ClipPair],
    *,
    subtitle: str = "",
    player: str = "spec",
) -> PageContent:
    """Return error curves, and a panel with the position and time of each clip's largest error, worst first.

    player: a name in PLAYERS.
    """
    found = sorted(pairs, key=lambda pair: -pair.error.max_error)
    least = MIN_ERROR_PER_DIAGONAL * ruler.diagonal
    errors = {}
    for i, pair in enumerate(found):
        if pair.error.max_error <= least:
            errors[pair.old] = ClipError(0.0)
        elif i < MAX_CURVES:
            curve = error_curve(ruler, old[pair.old], new[pair.new], player=player, fps=CURVE_FPS)
            errors[pair.old] = _clip_error(pair.error, *_reduce(*_with_peak(curve, pair.error)))
        else:
            errors[pair.old] = _clip_error(pair.error)
    rows = tuple(_row(ruler, old, pair) for pair in found if pair.error.max_error > least)
    if not rows:
        rows = (PageRow(("no vertex moves differently",)),)
    panel = PagePanel("Largest errors", rows, hot=len(rows[0].cells) - 1, about=_measured(ruler))
    partners = {pair.old: pair.new for pair in found}
    return PageContent(subtitle, (panel,), errors, partners, pair_nodes(ruler.pairs.partners))


def vertex_content(content: PageContent, found: VertexDistance, *, clip: int, label: str) -> PageContent:
    """Return the content of a bake beside its source with the errors that were measured vertex by vertex.

    clip: index in the first file. label: of the clip and the mesh with the largest error.
    """
    if found.max_error <= MIN_ERROR_PER_DIAGONAL * found.diagonal:
        panel = PagePanel("Largest errors", (PageRow(("no vertex moves differently",)),))
        return replace(content, panels=(panel, *content.panels), errors={clip: ClipError(0.0)})
    cells = (label, f"p99 {_length(found.p99)}", f"{found.time:.3f} s", _length(found.max_error))
    rows = (PageRow(cells, PageLink(clip, None, found.time)),)
    panel = PagePanel("Largest errors", rows, hot=len(cells) - 1, about=BAKE_MEASURED)
    curve = _reduce(np.array(found.times), np.array(found.errors))
    error = ClipError(found.max_error, *curve, time=found.time)
    return replace(content, panels=(panel, *content.panels), errors={clip: error})


def _measured(ruler: ErrorMetric) -> str:
    """The points that the figures are about, which differ between `diff` and the rest of the page."""
    if not has_vertices(ruler.scene):
        return NODES_MEASURED
    return SHELL_MEASURED if ruler.has_shell else VERTICES_MEASURED


def _clip_error(found: MotionError, times: tuple[float, ...] = (), errors: tuple[float, ...] = ()) -> ClipError:
    return ClipError(found.max_error, times, errors, found.joint, found.time)


def _row(ruler: ErrorMetric, old: Sequence[Clip], pair: ClipPair) -> PageRow:
    error = pair.error
    nodes = ruler.scene.skeleton.names
    node = nodes.index(error.joint) if error.joint in nodes else None
    p99 = () if pair.p99 is None else (f"p99 {_length(pair.p99)}",)
    name = f"{clip_name(old[pair.old].name, pair.old)} · {error.joint}"
    cells = (name, *p99, f"{error.time:.3f} s", _length(error.max_error))
    return PageRow(cells, PageLink(pair.old, node, error.time))


def _with_peak(curve: ErrorCurve, peak: MotionError) -> tuple[Floats, Floats]:
    """Times and errors of a curve, and the largest error at its own time, which the curve may not have."""
    i = int(np.searchsorted(curve.times, peak.time))
    if i < len(curve.times) and curve.times[i] == peak.time:
        return curve.times, curve.error
    return np.insert(curve.times, i, peak.time), np.insert(curve.error, i, peak.max_error)


def _reduce(times: Floats, errors: Floats) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """At most MAX_POINTS points of a curve: of each stretch the largest error, at its own time."""
    count = len(times)
    edges = np.unique(np.linspace(0, count, min(count, MAX_POINTS) + 1).astype(np.int64))
    kept = [int(first + np.argmax(errors[first:last])) for first, last in pairwise(edges.tolist())]
    return tuple(round(float(times[i]), 6) for i in kept), tuple(float(f"{errors[i]:.7g}") for i in kept)


def _length(meters: float) -> str:
    if not meters:
        return "0 mm"
    unit, factor = next((unit, factor) for least, unit, factor in UNITS if meters >= least)
    return f"{format_number(meters * factor, 3)} {unit}"
