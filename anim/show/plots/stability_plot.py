"""Plot of one system by every integrator: energy over time, gain per step against ω·h, and motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from anim.arrays import Floats, Ints
from anim.show.plots.figure import (
    FAINT,
    HAIR,
    INK,
    PAPER,
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
from anim.show.plots.stability_equations import TEST_EQUATIONS, TestEquation
from anim.show.plots.stability_titles import format_product, subtitle, title
from anim.simulation.comparison import Comparison, IntegratorRun
from anim.simulation.integrators import INTEGRATORS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLORS = {
    "explicit-euler": "#d55e00",
    "symplectic-euler": "#e69f00",
    "verlet": "#009e73",
    "velocity-verlet": "#56b4e9",
    "rk4": "#0072b2",
    "implicit-euler": "#7a7f87",
    "relaxation": "#cc79a7",
    "xpbd": "#7b3294",
}
SHOWN = ("explicit-euler", "verlet", "implicit-euler", "xpbd")  # drawn as poses: gains, keeps, loses energy
OWN = "this run's"  # beside the name of the simulation's own method
THICK, THIN = 2.0, 1.2
NUM_POSES = 9
MIN_CHANGE = 1e-9  # %, of energy; less is rounding
MAX_SHOWN_GROWTH = 4  # of energy, beyond which a run leaves the picture
MANY_SPRINGS = 200  # drawn as thin lines without points
VERLET_LIMIT = 2.0  # ω·h
MIN_GAIN, MAX_GAIN = 0.5, 1.6
MAX_RIPPLE = 0.5  # of the energy; a larger change is a loss, by drag or impacts
LIMIT_WORDS = {INTEGRATORS["rk4"].limit: "2√2"}
NAMES_APART = ",\n"
WIDTH, LEFT, HEAD, GAP = 11.6, 0.65, 0.95, 0.6  # inches
CURVES, LOG, CHANGE, POSES = 6.3, 1.75, 1.45, 2.6
LABELS = 1.75  # of the curves, at their right
STABILITY_HEIGHT = HEAD + LOG + 0.25 + CHANGE + GAP + 0.3 + POSES + 0.25
ON_PAPER = {"facecolor": PAPER, "edgecolor": "none", "pad": 1.0, "alpha": 0.85}  # words over curves


def stability_plot(compared: Comparison, *, kind: str) -> bytes:
    """Return the plot as the bytes of a PNG or SVG file. Its title states the result of these runs.

    Raises UnsupportedError where matplotlib is not installed.
    """
    with style(kind):
        sheet = Figure(WIDTH, STABILITY_HEIGHT)
        draw_stability(sheet, compared)
        return sheet.render(kind)


def draw_stability(sheet: Figure, compared: Comparison) -> None:
    """Draw the plot on a sheet of its width, STABILITY_HEIGHT inches high; the method of a simulation is marked."""
    runs, omega_h, step, springs = compared.runs, compared.omega_h, compared.step, compared.springs
    own = compared.method
    equation = TEST_EQUATIONS[compared.test_equation]
    sheet.text(LEFT - 0.4, 0.35, title(runs, equation, omega_h, step), fontsize=TITLE + 2, weight="bold")
    sheet.text(LEFT - 0.4, 0.6, subtitle(equation, omega_h, step), color=SOFT)
    _draw_energy(sheet, runs, own)
    draw_gain(sheet, equation, omega_h, own)
    top = HEAD + LOG + 0.25 + CHANGE + GAP + 0.3
    shown = [run for name in _shown(own) for run in runs if run.name == name]
    width = (WIDTH - LEFT - 0.2) / len(shown)
    drawn = [motion_points(run, springs, omega_h / step) for run in shown]
    span = _span(shown, drawn)
    for i, (run, points) in enumerate(zip(shown, drawn, strict=True)):
        place = LEFT - 0.4 + i * width, top, width - 0.15
        _draw_motion(sheet, run, points, springs, place, span, f"{OWN}: " if run.name == own else "")


def _shown(own: str) -> tuple[str, ...]:
    """The methods that are drawn as poses and thick, that of a simulation first."""
    return tuple(dict.fromkeys((own, *SHOWN)))


def _draw_energy(sheet: Figure, runs: Sequence[IntegratorRun], own: str) -> None:
    width = CURVES - LEFT - LABELS
    high = sheet.panel(LEFT, HEAD, width, LOG)
    low = sheet.panel(LEFT, HEAD + LOG + 0.25, width, CHANGE)
    end = max(float(run.times[-1]) for run in runs) or 1.0
    for run in runs:
        look = {"color": COLORS[run.name], "linewidth": THICK if run.name in _shown(own) else THIN}
        factor = run.energies / run.energies[0]
        high.semilogy(run.times, np.maximum(factor, 1e-3), **look)
        low.plot(run.times, 100 * (factor - 1), **look)
        if run.diverged_at is not None:
            high.plot(run.times[-1:], factor[-1:], "x", color=COLORS[run.name], markersize=8, markeredgewidth=2)
    high.set_ylim(0.3, 2e6)
    high.set_xlim(0, end)
    high.set_xticklabels([])
    low.set_xlim(0, end)
    changes = [0.0, *(c for run in runs if _keeps_energy(run) for c in 110 * (run.energies / run.energies[0] - 1))]
    low.set_ylim(max(min(-12, *changes), -60), min(max(6, *changes), 60))
    high.minorticks_off()
    low.axhline(0, color=HAIR, linewidth=0.8)
    low.set_xlabel("seconds", fontsize=SMALL, color=SOFT)
    sheet.text(LEFT, HEAD - 0.1, "Energy, factor of the start", fontsize=TEXT)
    sheet.text(LEFT, HEAD + LOG + 0.2, "the same, % gained or lost", fontsize=SMALL, color=SOFT)
    _draw_labels(sheet, runs, LEFT + width + 0.12, own)


def _draw_labels(sheet: Figure, runs: Sequence[IntegratorRun], x: float, own: str) -> None:
    """The name and result of each run, in the order of its energy, beside the curves."""
    order = sorted(runs, key=lambda run: -(1e9 - run.diverged_at if run.diverged_at else run.energy_change))
    heights = separate_labels([HEAD + 0.1 + 0.44 * i for i in range(len(order))], 0.44, HEAD, HEAD + LOG + CHANGE)
    for run, y in zip(order, heights, strict=True):
        wide = sheet.text(x, y, run.name, color=COLORS[run.name], weight="bold")
        if run.name == own:
            sheet.text(x + wide + 0.08, y, OWN, fontsize=SMALL, color=SOFT)
        words = f"diverges at {run.diverged_at:.2f} s" if run.diverged_at is not None else _change(run)
        sheet.text(x, y + 0.15, words, fontsize=SMALL, color=SOFT)


def _keeps_energy(run: IntegratorRun) -> bool:
    """True for a stable run of a symplectic integrator: its energy oscillates about the start's."""
    return run.diverged_at is None and abs(run.energy_change) < MAX_RIPPLE and _is_symplectic(run.name)


def _is_symplectic(name: str) -> bool:
    return name in INTEGRATORS and INTEGRATORS[name].limit == VERLET_LIMIT


def _change(run: IntegratorRun) -> str:
    if _keeps_energy(run):
        change = 100 * (run.energies / run.energies[0] - 1)
        change[np.abs(change) < MIN_CHANGE] = 0.0
        words = f"within {change.min():+.2g} … {change.max():+.2g} %"
    elif run.energy_change > 10:
        words = f"×{format_number(1 + run.energy_change)} after {run.times[-1]:.2g} s"
    else:
        change = 100 * run.energy_change
        words = f"{change if abs(change) >= MIN_CHANGE else 0.0:+.3g} % after {run.times[-1]:.2g} s"
    return words.replace("-", "−")


def draw_gain(sheet: Figure, equation: TestEquation, omega_h: float, own: str = "") -> Axes:
    """Draw the gain of each integrator per step, its limits and this run; return the axes."""
    left = CURVES + 0.45
    height = LOG + 0.25 + CHANGE
    axes = sheet.panel(left, HEAD, WIDTH - left - 0.25, height)
    lowest = MIN_GAIN if equation.symbol == "ω·h" else 0.0
    w = np.linspace(1e-3, equation.max_value, 500)
    for name, method in INTEGRATORS.items():
        if name != "velocity-verlet":  # the same curve as verlet
            dotted = ":" if name == "symplectic-euler" else "-"
            axes.plot(
                w,
                equation.gain(method, w),
                color=COLORS[name],
                linewidth=THICK if name in _shown(own) else THIN,
                linestyle=dotted,
            )
    axes.axhspan(1, MAX_GAIN, color="#d55e00", alpha=0.06, linewidth=0)
    for limit, words in _limits(equation):
        axes.axvline(limit, color=HAIR, linewidth=0.8)
        place = {"rotation": 90, "ha": "right", "va": "top", "color": SOFT, "bbox": ON_PAPER}
        axes.text(limit - 0.03, MAX_GAIN - 0.02, words, fontsize=SMALL, **place)
    is_left = not 0.02 < omega_h / equation.max_value < 0.2  # elsewhere than the dashed line
    x, grows = (0.02, MAX_GAIN - 0.06) if is_left else (0.99, 1.03)
    side = {"fontsize": SMALL, "ha": "left" if is_left else "right"}
    axes.text(x * equation.max_value, grows, "grows", color="#a33", **side)
    axes.text(x * equation.max_value, lowest + 0.03, "fades", color=SOFT, **side)
    _mark_run(axes, equation, omega_h, lowest, own)
    axes.set_xlim(0, equation.max_value)
    axes.set_ylim(lowest, MAX_GAIN)
    axes.set_xlabel(equation.about, fontsize=SMALL, color=SOFT)
    sheet.text(left, HEAD - 0.1, f"{equation.gain_of} gained per step", fontsize=TEXT)
    return axes


def _mark_run(axes: Axes, equation: TestEquation, omega_h: float, lowest: float, own: str) -> None:
    """This run's ω·h, with the gains of the integrators that are drawn thick."""
    words = f"{equation.symbol} = {format_product(omega_h)}"
    if omega_h > equation.max_value:
        axes.text(equation.max_value - 0.05, 1.06, f"this run: {words} →", fontsize=SMALL, ha="right", bbox=ON_PAPER)
    if not 0 < omega_h <= equation.max_value:
        return
    axes.axvline(omega_h, color=INK, linewidth=1, linestyle="--")
    for name in (each for each in _shown(own) if each in INTEGRATORS):
        gain = float(equation.gain(INTEGRATORS[name], np.array(omega_h)))
        if lowest <= gain <= MAX_GAIN:
            axes.plot([omega_h], [gain], "o", color=COLORS[name], markersize=5, clip_on=False)
    is_left = omega_h < 0.8 * equation.max_value
    x = omega_h + (0.05 if is_left else -0.05)
    y = 1.15 if lowest == 0 and omega_h < 1 else lowest + 0.12  # above the curves of drag
    axes.text(x, y, f"this run\n{words}", fontsize=SMALL, ha="left" if is_left else "right", bbox=ON_PAPER)


def _limits(equation: TestEquation) -> list[tuple[float, str]]:
    """Finite limits above 0 and the integrators that have them."""
    names: dict[float, list[str]] = {}
    for name, method in INTEGRATORS.items():
        limit = equation.limit(method)
        if 0 < limit < np.inf and name != "velocity-verlet":
            names.setdefault(limit, []).append(name)
    return [
        (limit, f"{LIMIT_WORDS.get(limit, f'{limit:.3g}')}: {NAMES_APART.join(each)}") for limit, each in names.items()
    ]


def _span(runs: Sequence[IntegratorRun], drawn: Sequence[Floats]) -> tuple[Floats, float]:
    """Center and half size of the motion's pictures, from the start and what stays near it."""
    near = [each if _stays_near(run) else each[:1] for run, each in zip(runs, drawn, strict=True)]
    points = np.concatenate([each.reshape(-1, 2) for each in near])
    low, high = points.min(axis=0), points.max(axis=0)
    return (low + high) / 2, 0.6 * float((high - low).max()) or 1.0


def _stays_near(run: IntegratorRun) -> bool:
    return run.diverged_at is None and bool(run.energies.max() < MAX_SHOWN_GROWTH * run.energies[0])


def motion_points(run: IntegratorRun, springs: Ints, omega: float) -> Floats:
    """Points (n, P, 2) to draw: x and y, or position and velocity / ω of the one moving point."""
    if len(springs) != 1:
        spread = np.ptp(run.positions[0], axis=0)  # seen from the side that shows more of the start
        return np.asarray(run.positions[..., [0 if spread[0] >= spread[2] else 2, 1]])
    return np.stack([run.positions[:, -1:, 0], run.velocities[:, -1:, 0] / max(omega, 1e-300)], axis=-1)


def _draw_motion(
    sheet: Figure,
    run: IntegratorRun,
    points: Floats,
    springs: Ints,
    place: tuple[float, float, float],
    span: tuple[Floats, float],
    mark: str,
) -> None:
    """mark: words before those on the duration."""
    x, y, width = place
    last = len(run.times) - 1
    phase = len(springs) == 1
    until = min(last, int(np.searchsorted(run.times, 1.0)) if not phase else last)
    what = "phase space: velocity / ω against position" if phase else f"0 to {run.times[until]:.2f} s"
    wide = sheet.text(x, y - 0.12, run.name, color=COLORS[run.name], weight="bold")
    sheet.text(x + wide + 0.1, y - 0.12, f"{mark}{what}", fontsize=SMALL, color=SOFT)
    axes = sheet.panel(x, y, width, POSES)
    axes.grid(visible=False)
    axes.set_xticks([])
    axes.set_yticks([])
    for side in axes.spines.values():
        side.set_visible(True)
        side.set_color(FAINT)
    center, half = span
    ratio = width / POSES
    axes.set_xlim(center[0] - half * max(ratio, 1), center[0] + half * max(ratio, 1))
    axes.set_ylim(center[1] - half * max(1 / ratio, 1), center[1] + half * max(1 / ratio, 1))
    if phase:
        axes.plot(points[:, 0, 0], points[:, 0, 1], color=COLORS[run.name], linewidth=0.9)
        axes.plot(points[:1, 0, 0], points[:1, 0, 1], "o", color=INK, markersize=4)
        return
    _draw_poses(axes, points[np.linspace(0, until, NUM_POSES).astype(int)], springs, COLORS[run.name])


def _draw_poses(axes: Axes, poses: Floats, springs: Ints, color: str) -> None:
    for i, pose in enumerate(poses):
        alpha = 0.15 + 0.85 * i / (NUM_POSES - 1)
        if not len(springs):
            axes.plot(pose[:, 0], pose[:, 1], "o", color=color, markersize=2.5, alpha=alpha, markeredgewidth=0)
            continue
        lines = edge_lines(pose, springs)
        look = "-o" if len(springs) < MANY_SPRINGS else "-"
        width = 1.0 if len(springs) < MANY_SPRINGS else 0.4
        axes.plot(lines[:, 0], lines[:, 1], look, color=color, markersize=2, linewidth=width, alpha=alpha)
