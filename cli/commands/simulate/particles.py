"""`gltf-anim simulate particles`: sparks, dust, rain: emitted by nodes or surfaces."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from typing import Annotated

import typer

from anim.errors import UnsupportedError
from anim.gltf.document import Document
from anim.measure.error.surface import diagonal
from anim.model import Clip, Scene
from anim.operations.selection import Selection
from anim.simulation.particles.emission import Emitter
from anim.simulation.particles.forces import Forces
from anim.simulation.particles.obstacles import Box, Floor, Obstacle, Sphere
from anim.simulation.particles.simulate import ParticleOptions, add_particles, simulate_particles
from anim.simulation.particles.solver import Contact
from anim.simulation.registry import SIMULATIONS
from anim.simulation.report import SimulationReport
from anim.units import is_zero_angle
from cli import text, units
from cli.options import common, simulation
from cli.options.simulation import parse_numbers, parse_seconds, parse_vector
from cli.text import Reporter
from cli.workflows.simulate_clip import simulate_clip

ROUNDING_M = 1e-9
MANY_NODES, MAX_NODES = 2000, 10_000  # players take milliseconds a frame; binding alone takes seconds


class Source(StrEnum):
    """Where particles leave."""

    NODE = "node"
    SURFACE = "surface"


def command(
    input: common.Input = "-",
    output: common.Output = "-",
    *,
    node: Annotated[
        list[str], typer.Option("--node", metavar="GLOB", help="Nodes that emit; may be repeated.", show_default=False)
    ],
    emit: Annotated[
        Source, typer.Option("--emit", help="node: from its origin. surface: from its skinned mesh, along normals.")
    ] = Source.NODE,
    rate: Annotated[float, typer.Option("--rate", metavar="N", help="Particles per second and node.", min=0)] = 50.0,
    burst: Annotated[int, typer.Option("--burst", metavar="N", help="Particles per node at the start.", min=0)] = 0,
    start: Annotated[
        float | None, typer.Option("--from", metavar="S", help="Start of the emission in seconds.")
    ] = None,
    end: Annotated[float | None, typer.Option("--to", metavar="S", help="End of the emission in seconds.")] = None,
    lifetime: Annotated[float, typer.Option("--lifetime", metavar="S", help="Lifetime in seconds.")] = 1.5,
    speed: Annotated[float, typer.Option("--speed", metavar="M/S", help="Speed of emission.", min=0)] = 2.0,
    direction: Annotated[
        str, typer.Option("--direction", metavar="X,Y,Z", help="Direction of emission, in the node's space.")
    ] = "0,1,0",
    spread: Annotated[
        str, typer.Option("--spread", metavar="ANGLE", help="Half the angle of the cone of emission; 0: a jet.")
    ] = "20deg",
    variation: Annotated[
        float, typer.Option("--variation", metavar="0..1", help="Random part of speed and lifetime.", min=0, max=1)
    ] = 0.25,
    inherit: Annotated[
        float, typer.Option("--inherit", metavar="N", help="Fraction of the emitter's own velocity that is added.")
    ] = 1.0,
    size: Annotated[
        str, typer.Option("--size", metavar="LENGTH", help="Radius of a particle, such as 2cm, or % of the model.")
    ] = "0.5%",
    gravity: simulation.Gravity = simulation.EARTH_GRAVITY,
    drag: Annotated[float, typer.Option("--drag", metavar="N", help="Linear drag per second.", min=0)] = 0.0,
    quadratic_drag: Annotated[
        float, typer.Option("--quadratic-drag", metavar="N", help="Quadratic drag per metre.", min=0)
    ] = 0.0,
    wind: simulation.Wind = "0,0,0",
    turbulence: Annotated[
        float, typer.Option("--turbulence", metavar="M/S", help="Random part of the wind; needs drag.", min=0)
    ] = 0.0,
    turbulence_size: Annotated[
        float, typer.Option("--turbulence-size", metavar="M", help="Size of the eddies of the air in metres.")
    ] = 0.5,
    floor: simulation.FloorHeight = None,
    sphere: Annotated[
        list[str] | None,
        typer.Option("--sphere", metavar="X,Y,Z,R", help="A ball to bounce off, in metres; may be repeated."),
    ] = None,
    box: Annotated[
        list[str] | None,
        typer.Option("--box", metavar="X,Y,Z,SX,SY,SZ", help="A box to bounce off: center, size; may be repeated."),
    ] = None,
    restitution: simulation.Restitution = 0.5,
    friction: simulation.Friction = 0.3,
    integrator: simulation.IntegratorOption = simulation.VELOCITY_VERLET,
    step: simulation.Step = SIMULATIONS["particles"].step,
    fps: simulation.Fps = simulation.DEFAULT_FPS,
    duration: simulation.Duration = None,
    warm_up: simulation.WarmUp = 0.0,
    loop: simulation.Loop = False,
    seed: simulation.Seed = 0,
    clip: simulation.Clip = None,
    merge: simulation.Merge = False,
    name: simulation.Name = "particles",
    force: Annotated[bool, typer.Option("--force", help=f"Write more than {MAX_NODES} nodes.")] = False,
    report: simulation.ReportFile = None,
    dry_run: common.DryRun = False,
    quiet: common.Quiet = False,
    verbose: common.Verbose = False,
) -> None:
    """Emit particles from nodes, and let forces move them.

    Each is a node with one shared mesh; a node is used again when its particle has died. Without drag, and with verlet,
    velocity-verlet or rk4 only, a path is written as the exact parabolas between impacts; else it has a key per frame.
    The time of an impact is found inside the step. Wind and turbulence need drag. --floor, --sphere and --box stop the
    centers of particles, not their surfaces. --loop begins with the particles that are alive at the end, so that the
    clip repeats without a seam.
    """
    simulation.check_fps(fps)
    options = ParticleOptions(
        Forces(
            parse_vector(gravity, "--gravity"),
            drag,
            quadratic_drag,
            parse_vector(wind, "--wind"),
            turbulence,
            turbulence_size,
            seed,
        ),
        _obstacles(floor, sphere or [], box or []),
        Contact(restitution, friction),
        integrator.value,
        parse_seconds(step, "--step"),
        fps,
        warm_up=warm_up,
        loop=loop,
        seed=seed,
    )

    def simulate(
        document: Document, scene: Scene, driver: Clip, number: int | None
    ) -> tuple[Document, SimulationReport, str]:
        found = Selection((), node).chosen_nodes(scene.skeleton)
        emitter = Emitter(
            tuple(sorted(found)),
            rate,
            burst,
            emit is Source.SURFACE,
            parse_vector(direction, "--direction"),
            speed,
            0.0 if is_zero_angle(spread) else units.parse_angle(spread, "--spread"),
            lifetime,
            variation,
            variation,
            inherit,
            start,
            end,
        )
        seconds = duration if duration is not None else driver.end - driver.start or 2.0
        radius = units.parse_length(size, "--size", lambda: diagonal(scene))
        chosen = replace(options, duration=seconds, size=radius, start=driver.start)
        run = simulate_particles(scene, driver, emitter, chosen)
        _check_nodes(len(run.nodes), voice, force=force)
        merged = (number, driver) if merge and number is not None else None
        return add_particles(document, run, chosen, name, merged), run.report, _summary(run.report)

    voice = Reporter(quiet, verbose)
    simulate_clip(input, output, clip, simulate, voice, report=report, dry_run=dry_run)


def _summary(report: SimulationReport) -> str:
    figures = report.figures
    parts = [
        text.plural(figures["particles"], "particle"),
        text.plural(figures["nodes"], "node"),
        text.plural(figures["impacts"], "impact"),
        f"{report.duration_s:g} s in steps of 1/{1 / report.step_s:g} s",
    ]
    if report.error_estimate_m and report.error_estimate_m > ROUNDING_M:
        parts.append(f"half the step differs by {text.format_length(report.error_estimate_m)}")
    return ", ".join(parts)


def _check_nodes(count: int, voice: Reporter, *, force: bool) -> None:
    if count > MAX_NODES and not force:
        raise UnsupportedError(
            f"{count} particles at a time (limit {MAX_NODES} nodes)", help="lower --rate, or --force"
        )
    if count > MANY_NODES:
        voice.warn(f"{count} nodes: players need several milliseconds a frame for them")


def _obstacles(floor: float | None, spheres: list[str], boxes: list[str]) -> tuple[Obstacle, ...]:
    found: list[Obstacle] = [] if floor is None else [Floor(floor)]
    for each in spheres:
        values = parse_numbers(each, 4, "--sphere")
        found.append(Sphere((values[0], values[1], values[2]), values[3]))
    for each in boxes:
        values = parse_numbers(each, 6, "--box")
        found.append(Box((values[0], values[1], values[2]), (values[3], values[4], values[5])))
    return tuple(found)
