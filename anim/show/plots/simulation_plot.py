"""Plot of a simulation's report: every integrator on its system, or energy, step error and poses."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.show.plots.figure import (
    COLORS,
    FAINT,
    INK,
    SMALL,
    SOFT,
    TEXT,
    TITLE,
    Figure,
    edge_lines,
    format_number,
    separate_labels,
    style,
)
from anim.show.plots.stability_plot import STABILITY_HEIGHT, draw_stability
from anim.show.plots.stability_titles import format_step
from anim.simulation.comparison import Comparison
from anim.simulation.report import RunHistory, SimulationReport

WIDTH, EDGE, LEFT, HEAD = 11.6, 0.25, 0.75, 0.95  # inches
ENERGY, ERROR, GAP, POSES = 2.3, 1.1, 0.55, 4.0
LABELS, CURVES = 1.1, 6.3
NUM_POSES = 9
RUN_HEIGHT = HEAD + POSES + 0.5
HEAD_ONLY, BANNER = 0.75, 0.3  # the words on a run without curves, and those above the comparison
MIN_LENGTH_M = 1e-9  # less is rounding
MANY_EDGES = 200  # drawn as thin lines
MAX_PATHS = 60  # points with a path; more only fill the picture


def simulation_plot(report: SimulationReport, *, kind: str) -> bytes:
    """Return the picture of a report as a PNG or SVG file; its title is computed from the run.

    Raises UnsupportedError where matplotlib is not installed.
    """
    with style(kind):
        compared = None if report.compare is None else report.compare()
        top = HEAD_ONLY if compared is not None and report.history is None else RUN_HEIGHT
        sheet = Figure(WIDTH, top + (0.0 if compared is None else BANNER + STABILITY_HEIGHT))
        sheet.text(EDGE, 0.35, _title(report, compared), fontsize=TITLE + 2, weight="bold")
        sheet.text(EDGE, 0.6, _subtitle(report), color=SOFT)
        if report.history is not None and len(report.history.times) > 1:
            _draw_run(sheet, report.history)
        if compared is not None:
            sheet.offset = top + BANNER
            sheet.text(EDGE, 0.0, _banner(compared), fontsize=TITLE)
            draw_stability(sheet, compared)
        return sheet.render(kind)


def _draw_run(sheet: Figure, history: RunHistory) -> None:
    has_error = len(history.errors) > 0
    _draw_energy(sheet, history, POSES if not has_error else ENERGY)
    if has_error:
        _draw_error(sheet, history)
    _draw_poses(sheet, history)


def _banner(compared: Comparison) -> str:
    """The words above the comparison, whose curves are not those of the run."""
    others = "" if compared.method in {run.name for run in compared.runs} else "; this run is by none of them"
    return f"For comparison: {compared.about}, by every integrator{others}"


def _title(report: SimulationReport, compared: Comparison | None) -> str:
    method = "" if compared is None or not compared.method else f", by {compared.method}"
    start = f"{report.kind}: steps of {format_step(report.step_s)}, {format_number(report.duration_s)} s{method}"
    if report.first_bad_step is not None:
        return f"{start}: diverges at {format_number(report.first_bad_step * report.step_s)} s"
    return ": ".join([start, *_results(report)[:1]])


def _results(report: SimulationReport) -> list[str]:
    """The figures of a run in words, the first of them for the title."""
    parts = []
    if report.energy_j is not None:
        drawn = None if report.history is None else report.history.energies.get("total")
        if drawn is not None and len(drawn):  # above the lowest potential, as the curve below
            ends = [float(drawn[0]), float(drawn[-1])]
        else:
            ends = [report.energy_j["start"], report.energy_j["end"]]
        parts.append(f"energy {format_number(ends[0])} → {format_number(ends[1])} J")
    if report.worst_stretch is not None:
        parts.append(f"stretched by {float(100 * report.worst_stretch['fraction']):.2g} % at most")
    if report.error_estimate_m is not None:
        parts.append(f"a run with half the step differs by up to {_length(report.error_estimate_m)}")
    if report.penetration_m is not None:
        parts.append(f"deepest penetration {_length(report.penetration_m)}")
    if report.loop_seam_m is not None:
        parts.append(f"seam of the loop {_length(report.loop_seam_m)}")
    return parts


def _subtitle(report: SimulationReport) -> str:
    """Advice, and the figures that the title lacks."""
    left = _results(report)[0 if report.first_bad_step is not None else 1 :]
    return "; ".join(filter(None, (report.advice, ", ".join(left))))


def _length(meters: float) -> str:
    if 0 < meters < MIN_LENGTH_M:
        return "<1 nm"
    return f"{format_number(1000 * meters)} mm" if meters < 1 else f"{format_number(meters)} m"


def _draw_energy(sheet: Figure, history: RunHistory, height: float) -> None:
    width = CURVES - LEFT - LABELS
    axes = sheet.panel(LEFT, HEAD, width, height)
    words = "Energy, J, above the lowest potential" if "potential" in history.energies else "Energy, J"
    sheet.text(LEFT, HEAD - 0.1, words, fontsize=TEXT)
    ends = []
    for color, (name, values) in zip((INK, *COLORS), history.energies.items(), strict=False):
        axes.plot(history.times, values, color=color, linewidth=2.0 if name == "total" else 1.2)
        ends.append((name, color, float(values[-1])))
    axes.set_xlim(0, float(history.times[-1]))
    if len(history.errors):
        axes.set_xticklabels([])
    else:
        axes.set_xlabel("seconds", fontsize=SMALL, color=SOFT)
    low, high = axes.get_ylim()
    at = [HEAD + height * (high - value) / (high - low) for _, _, value in ends]
    for (name, color, _), y in zip(ends, separate_labels(at, 0.17, HEAD, HEAD + height), strict=True):
        sheet.text(LEFT + width + 0.12, y + 0.04, name, color=color)


def _draw_error(sheet: Figure, history: RunHistory) -> None:
    top = HEAD + ENERGY + GAP
    axes = sheet.panel(LEFT, top, CURVES - LEFT - LABELS, POSES - ENERGY - GAP)
    sheet.text(LEFT, top - 0.1, "Distance to the run with half the step, mm", fontsize=TEXT)
    axes.plot(history.times, 1000 * history.errors, color=COLORS[0], linewidth=1.2)
    axes.set_xlim(0, float(history.times[-1]))
    axes.set_ylim(bottom=0)
    axes.set_xlabel("seconds", fontsize=SMALL, color=SOFT)


def _draw_poses(sheet: Figure, history: RunHistory) -> None:
    """Poses from pale to dark, seen from the side that shows most motion, with the paths of points."""
    left = CURVES + 0.3
    sheet.text(left, HEAD - 0.1, f"Poses from 0 to {format_number(float(history.times[-1]))} s", fontsize=TEXT)
    width = WIDTH - left - 0.25
    axes = sheet.panel(left, HEAD, width, POSES)
    axes.grid(visible=False)
    axes.set_xticks([])
    axes.set_yticks([])
    for side in axes.spines.values():
        side.set_visible(True)
        side.set_color(FAINT)
    points = _side_view(history.positions)
    low, high = points.min(axis=(0, 1)), points.max(axis=(0, 1))
    half = 0.6 * max(float((high - low)[0]) / width, float((high - low)[1]) / POSES, 1e-6)
    middle = (low + high) / 2
    axes.set_xlim(middle[0] - half * width, middle[0] + half * width)
    axes.set_ylim(middle[1] - half * POSES, middle[1] + half * POSES)
    for point in range(0, points.shape[1], -(-points.shape[1] // MAX_PATHS)):
        axes.plot(points[:, point, 0], points[:, point, 1], color=FAINT, linewidth=0.8)
    width = 1.0 if len(history.edges) < MANY_EDGES else 0.4
    for i, frame in enumerate(np.linspace(0, len(points) - 1, NUM_POSES).astype(int)):
        alpha = 0.12 + 0.88 * i / (NUM_POSES - 1)
        pose = points[frame]
        if len(history.edges):
            lines = edge_lines(pose, history.edges)
            axes.plot(lines[:, 0], lines[:, 1], color=COLORS[2], linewidth=width, alpha=alpha)
        else:
            axes.plot(pose[:, 0], pose[:, 1], "o", color=COLORS[2], markersize=3, alpha=alpha, markeredgewidth=0)


def _side_view(positions: Floats) -> Floats:
    """Points (n, P, 2): along x or z, whichever spreads more, and upwards along y."""
    spread = np.ptp(positions.reshape(-1, 3), axis=0)
    return np.asarray(positions[..., [0 if spread[0] >= spread[2] else 2, 1]])
