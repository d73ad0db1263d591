"""Options of all kinds of simulation."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from fractions import Fraction
from typing import Annotated

import typer

from anim.errors import RangeError
from anim.measure.error.surface import diagonal
from anim.model import Clip as DrivingClip
from anim.model import Scene
from anim.simulation.integrators import INTEGRATORS
from anim.simulation.particles.forces import EARTH_GRAVITY_M_S2
from cli import units
from cli.errors import UsageError

EARTH_GRAVITY = ",".join(f"{value:g}" for value in EARTH_GRAVITY_M_S2)
Integrator = StrEnum("Integrator", [(name, name) for name in INTEGRATORS])  # type: ignore[misc]
VELOCITY_VERLET = Integrator("velocity-verlet")
ABOUT_INTEGRATORS = "; ".join(
    f"{name}: order {each.order}{f' ({each.drag_order} with drag or damping)' * (each.drag_order != each.order)}, "
    f"{each.about}"
    for name, each in INTEGRATORS.items()
)
DEFAULT_FPS = 60.0
DEFAULT_DURATION_S = 2.0  # without a clip that has a length
RIGID_DURATION_S = 5.0  # likewise, of rigid bodies: a pile takes longer to come to rest

Clip = Annotated[
    str | None,
    typer.Option("--clip", metavar="GLOB", help="The clip that drives the simulation; the first without this."),
]
Fps = Annotated[float, typer.Option("--fps", metavar="N", help="Output frames per second.")]
Step = Annotated[
    str, typer.Option("--step", metavar="S", help="Time step of the simulation in seconds, such as 1/240.")
]
Duration = Annotated[
    float | None,
    typer.Option(
        "--duration",
        metavar="S",
        help="Seconds to simulate; without this the length of the clip, or "
        f"{DEFAULT_DURATION_S:g} without a clip ({RIGID_DURATION_S:g} for rigid bodies).",
        min=0,
    ),
]
WarmUp = Annotated[
    float,
    typer.Option("--warm-up", metavar="S", help="Seconds to simulate before the first frame, at its pose.", min=0),
]
Loop = Annotated[bool, typer.Option("--loop", help="Close the loop: end as it begins, and report the seam.")]
Seed = Annotated[int, typer.Option("--seed", metavar="N", help="Seed of random numbers.", min=0)]
IntegratorOption = Annotated[
    Integrator, typer.Option("--integrator", help=f"Method of time integration. {ABOUT_INTEGRATORS}.")
]
MaxError = Annotated[
    str | None,
    typer.Option("--max-error", metavar="LENGTH", help="Remove keys within this error, such as 0.5mm or 0.1%."),
]
ReportFile = Annotated[
    str | None,
    typer.Option(
        "--report",
        metavar="FILE",
        help="Write a report: steps, stability, energy, error (.json), or its picture (.png).",
    ),
]
Gravity = Annotated[str, typer.Option("--gravity", metavar="X,Y,Z", help="Acceleration in m/s².")]
Wind = Annotated[str, typer.Option("--wind", metavar="X,Y,Z", help="Velocity of the air in m/s.")]
Spheres = Annotated[
    list[str] | None,
    typer.Option("--sphere", metavar="AT,R", help="A ball at X,Y,Z or at a node, and its radius; may be repeated."),
]
Capsules = Annotated[
    list[str] | None,
    typer.Option("--capsule", metavar="A,B,R", help="A capsule from node A to node B; may be repeated."),
]
Planes = Annotated[
    list[str] | None,
    typer.Option(
        "--plane",
        metavar="AT,N",
        help="A plane at X,Y,Z or at a node, and its normal NX,NY,NZ (a node's y axis without); may be repeated.",
    ),
]
Colliders = Annotated[
    list[str] | None,
    typer.Option(
        "--colliders",
        metavar="vrm|FILE",
        help="Colliders of the file's own VRM spring bones, or of a JSON file as of simulate springs.",
    ),
]
ParticleColliders = Annotated[
    list[str] | None,
    typer.Option(
        "--colliders",
        metavar="vrm|khr|FILE",
        help="Colliders of the file's VRM spring bones, of its rigid bodies, or of a JSON file as of simulate springs.",
    ),
]
FloorHeight = Annotated[float | None, typer.Option("--floor", metavar="Y", help="Height in metres of a floor.")]
Friction = Annotated[float, typer.Option("--friction", metavar="N", help="Coulomb's friction.", min=0)]
Restitution = Annotated[
    float, typer.Option("--restitution", metavar="0..1", help="Speed kept by a bounce.", min=0, max=1)
]
Merge = Annotated[bool, typer.Option("--merge", help="Add the tracks to the driving clip, not to a new one.")]
Name = Annotated[str, typer.Option("--name", metavar="NAME", help="Name of the new clip, and of new nodes.")]


def chosen_duration(given: float | None, driver: DrivingClip, default: float = DEFAULT_DURATION_S) -> float:
    """Return the seconds to simulate: as given, else the length of the driving clip, else a default."""
    return given if given is not None else driver.end - driver.start or default


def chosen_bound(given: str | None, scene: Scene, warn: Callable[[str], None]) -> float:
    """Return the error bound in m, 0 without one; one without a unit is warned of."""
    return 0.0 if given is None else units.parse_bound(given, "--max-error", lambda: diagonal(scene), warn)


def check_fps(fps: float) -> None:
    """Raise UsageError unless `fps` is above 0."""
    if fps <= 0:
        raise UsageError(f"--fps is {fps:g} (expected a number above 0)")


@contextmanager
def name_option(option: str, given: str) -> Iterator[None]:
    """Raise UsageError with the option and what was given for values of it that are out of range."""
    try:
        yield
    except RangeError as error:
        problem = error.problem.replace("`", "")  # parameters of the part, not the command's options
        raise UsageError(f"{option} is '{given}': {problem}", help=error.help) from None


def parse_vector(given: str, option: str) -> tuple[float, float, float]:
    """Return "X,Y,Z" as three finite numbers. Raises UsageError."""
    x, y, z = parse_numbers(given, 3, option)
    return x, y, z


def parse_numbers(given: str, count: int, option: str) -> list[float]:
    """Return numbers with commas between. Raises UsageError for another count, or numbers that aren't finite."""
    try:
        values = [float(each) for each in given.split(",")]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise UsageError(f"{option} is '{given}' (expected {count} numbers with commas between)")
    return values


def parse_seconds(text: str, option: str) -> float:
    """Return seconds above 0 from "1/240", "0.01" or "10ms". Raises UsageError."""
    match = re.fullmatch(r"\s*([\d.]+(?:e[+-]?\d+)?(?:/[\d.]+)?)\s*(s|ms)?\s*", text, re.IGNORECASE)
    try:
        top, _, bottom = (match[1] if match else "").partition("/")
        value = float(Fraction(top) / Fraction(bottom or 1)) * (1e-3 if match and match[2] == "ms" else 1.0)
    except (ValueError, ZeroDivisionError, OverflowError):
        value = 0.0
    if not value > 0:
        raise UsageError(f"{option} is '{text}' (expected seconds above 0, such as 1/240 or 5ms)")
    return value
