"""Report of a simulation: step size against stability, energy, error."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from anim.arrays import Floats, Ints
from anim.simulation.comparison import Comparison

SCHEMA = "simulate/1"
PICTURED = ("compare", "history")  # fields for the picture alone
SAFE_STEP_FRACTION = 0.9  # of the stability limit, for advice
VERLET_LIMIT = 2.0  # of ω·h


@dataclass(frozen=True, slots=True, eq=False)
class RunHistory:
    """One run over time, for its picture.

    times: (n,) s. energies: (n,) J by name, such as "kinetic". positions: (n, P, 3) m of what moves.
    edges: (E, 2) pairs of points to draw as lines. errors: (n,) m, distance to the run with half the step; or empty.
    """

    times: Floats
    energies: Mapping[str, Floats]
    positions: Floats
    edges: Ints
    errors: Floats


@dataclass(frozen=True, slots=True)
class SimulationReport:
    """Figures of one run; None where a kind of simulation has no such figure.

    step_s: of the simulation, which divides a frame of the output. num_steps: from 0 on. integrator: a name in
    INTEGRATORS, or "" for a kind with a method of its own. omega_h: largest angular frequency times step, limit: the
    integrator's. energy_j: {"start", "end", "peak"}. drift_per_s: relative change of energy per second.
    worst_stretch: {"fraction", "where", "time_s"}. penetration_m: deepest, into an obstacle.
    first_bad_step: index of the first step without a finite result. error_estimate_m: largest distance to the same run
    with half the step. figures: of this kind alone, by JSON key. advice: a line with a runnable option, or "".
    For the picture, and not in the JSON: compare, the run's system by every integrator, and history, the run itself.
    """

    kind: str
    step_s: float
    num_steps: int
    fps: float
    duration_s: float
    warm_up_s: float = 0.0
    integrator: str = ""
    omega_h: float | None = None
    omega_h_limit: float | None = None
    energy_j: Mapping[str, float] | None = None
    drift_per_s: float | None = None
    worst_stretch: Mapping[str, Any] | None = None
    penetration_m: float | None = None
    first_bad_step: int | None = None
    error_estimate_m: float | None = None
    loop_seam_m: float | None = None
    figures: Mapping[str, Any] = field(default_factory=dict)
    advice: str = ""
    compare: Callable[[], Comparison] | None = None
    history: RunHistory | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the report as JSON values; an infinite limit is null."""
        result: dict[str, Any] = {"schema": SCHEMA}
        for each in fields(self):
            value = getattr(self, each.name)
            if each.name == "figures":
                result |= value
            elif each.name not in PICTURED:
                result[each.name] = None if isinstance(value, float) and not math.isfinite(value) else value
        return result


def advise_step(omega_h: float, limit: float, step: float, integrator: str, rk4_limit: float = 2 * math.sqrt(2)) -> str:
    """Return advice for a step beyond the stability limit: "ω·h = 2.4, verlet's limit is 2: --step 1/282 or …"."""
    if omega_h <= limit:
        return ""
    per_second = math.ceil(omega_h / (step * (limit or VERLET_LIMIT) * SAFE_STEP_FRACTION))
    if not limit:
        finer = f" --step 1/{per_second}" if omega_h > VERLET_LIMIT else ""
        return f"{integrator} always gains energy: --integrator verlet{finer}"
    words = f"ω·h = {omega_h:.3g}, {integrator}'s limit is {limit:.3g}"
    other = " or --integrator rk4" if integrator != "rk4" and omega_h < rk4_limit else ""
    return f"{words}: --step 1/{per_second}{other}"


def advise_drag_step(drag_h: float, limit: float, step: float, integrator: str) -> str:
    """Return advice for drag beyond the stability limit: "drag·h = 15, explicit-euler's limit is 2: --step 1/500 …"."""
    if drag_h <= limit:
        return ""
    per_second = math.ceil(drag_h / (step * limit * SAFE_STEP_FRACTION))
    words = f"drag·h = {drag_h:.3g}, {integrator}'s limit is {limit:.3g}"
    return f"{words}: --step 1/{per_second} or --integrator implicit-euler"


def advise_half_step(step: float) -> str:
    """Return advice for a run that diverges by a method without a stability limit: "--step 1/1200"."""
    return f"--step 1/{math.ceil(2 / step - 1e-6)}"


def describe_elongation(worst: Mapping[str, Any] | None, substeps: int, limit: float | None) -> str:
    """Return "stretched by 5 % at 0.4 s with 80 substeps a frame (limit 2 %)"; "" for a cloth within the limit."""
    if worst is None or limit is None or worst["fraction"] <= limit:
        return ""
    stretched = f"stretched by {100 * worst['fraction']:.3g} % at {worst['time_s']:.3g} s"
    return f"{stretched} with {substeps} substeps a frame (limit {100 * limit:.3g} %)"


def advise_elongation(solver: str, *, is_start: bool = False, is_attachment: bool = False) -> str:
    """Return advice for a cloth that is stretched beyond the limit in spite of many substeps.

    is_start: the pose that it begins with is the one that is stretched. is_attachment: the animation moves pinned
    vertices farther apart than the cloth between them is long.
    """
    if is_start:
        return "the clip's first pose stretches it: --warm-up 1 lets it relax before"
    if is_attachment:
        return "the clip stretches the vertices that it is attached to: choose others with --cloth or --pin"
    fabric = {"mass-spring": "a higher --stiffness", "relaxation": "more --iterations"}
    return f"a larger --max-stretch, a higher --fps, or {fabric.get(solver, 'a mesh with longer edges')}"
