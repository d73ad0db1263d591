"""`gltf-anim simulate particles`: sparks, dust, rain: emitted by nodes or surfaces."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from pathlib import PurePath
from typing import Annotated

import typer

from anim.caches.points import POINT_FORMATS, encode_points
from anim.errors import DataRangeError, UnsupportedError
from anim.gltf.document import Document
from anim.measure.error.surface import diagonal
from anim.model import Clip, Scene
from anim.operations.selection import Selection
from anim.simulation.particles.emission import Emitter
from anim.simulation.particles.forces import Forces
from anim.simulation.particles.obstacles import Floor, Obstacle
from anim.simulation.particles.options import MAX_SIZE_M, MIN_SIZE_M, SPARK_KG, ParticleOptions
from anim.simulation.particles.rigid_colliders import read_rigid_colliders
from anim.simulation.particles.simulate import add_particles, check_simultaneous, simulate_particles
from anim.simulation.particles.solver import Contact
from anim.simulation.registry import SIMULATIONS
from anim.simulation.report import SimulationReport
from anim.units import is_zero_angle, plural
from cli import text, units
from cli.errors import UsageError
from cli.options import common, simulation
from cli.options.simulation import parse_seconds, parse_vector
from cli.progress import announce_compiling
from cli.text import Reporter
from cli.workflows.colliders import parse_colliders
from cli.workflows.particle_options import parse_attractor, parse_box
from cli.workflows.simulate_clip import note_own_clip, simulate_clip

ROUNDING_M = 1e-9
RIGID_BODIES = "khr"  # a value of --colliders
MANY_DRAWS = 1000  # nodes, from which one skinned mesh is the better file
MANY_NODES, MAX_NODES = 2000, 10_000  # players take a second to bind the tracks of some 2 500; then ever more


class Form(StrEnum):
    """Form of particles in a file."""

    NODE = "node"
    SKIN = "skin"


class Source(StrEnum):
    """Where particles leave."""

    NODE = "node"
    SURFACE = "surface"


def command(
    input: common.Input = "-",
    output: Annotated[
        str,
        typer.Argument(
            metavar="OUT",
            help="A .glb or .gltf file, '-' for stdout (GLB); or points as .npz, .usdc or .usda.",
            show_default=False,
        ),
    ] = "-",
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
    form: Annotated[
        Form, typer.Option("--as", help="node: a node each. skin: one skinned mesh, a joint each, in one draw call.")
    ] = Form.NODE,
    size: Annotated[
        str, typer.Option("--size", metavar="LENGTH", help="Radius of a particle, such as 2cm, or % of the model.")
    ] = "0.5%",
    mass: Annotated[
        float, typer.Option("--mass", metavar="KG", help="Mass of a particle, for energies in the report.")
    ] = SPARK_KG,
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
    attractor: Annotated[
        list[str] | None,
        typer.Option(
            "--attractor",
            metavar="NODE:N[:LENGTH]",
            help="A node that pulls with N m/s² at LENGTH, 10% of the model without it; below 0 pushes; repeatable.",
        ),
    ] = None,
    floor: simulation.FloorHeight = None,
    sphere: simulation.Spheres = None,
    box: Annotated[
        list[str] | None,
        typer.Option("--box", metavar="AT,SX,SY,SZ", help="A box at X,Y,Z or on a node, and its sizes; repeatable."),
    ] = None,
    capsule: simulation.Capsules = None,
    plane: simulation.Planes = None,
    colliders: simulation.ParticleColliders = None,
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
    max_error: simulation.MaxError = None,
    report: simulation.ReportFile = None,
    dry_run: common.DryRun = False,
    quiet: common.Quiet = False,
    verbose: common.Verbose = False,
) -> None:
    """Emit particles from nodes, and let forces move them.

    Each is a node with one shared mesh, or a joint of one skinned mesh; a node is used again when its particle has
    died. Their clip is a new one, without the motion of the driving clip; --merge adds them to that. OUT.npz, .usdc or
    .usda hold points with ids instead. Without drag, turbulence and attractors, and with
    verlet, velocity-verlet or rk4 only, a path is written as the exact parabolas between impacts; else it has a key per
    frame, of which --max-error removes some. The time of an impact is found inside the step. Wind and turbulence need
    drag. Obstacles and attractors on nodes follow the clip in every step. Balls, boxes, capsules and planes stop the
    centers of particles, not their surfaces; meshes are no obstacles. --loop begins with the particles that are alive
    at the end, so that the clip repeats without a seam.
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
        (),
        Contact(restitution, friction),
        integrator.value,
        parse_seconds(step, "--step"),
        fps,
        warm_up=warm_up,
        loop=loop,
        seed=seed,
        mass=mass,
    )
    ending = PurePath(output).suffix.lower()

    def simulate(
        document: Document, scene: Scene, driver: Clip, number: int | None
    ) -> tuple[Document | bytes, SimulationReport, str]:
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
        seconds = simulation.chosen_duration(duration, driver)
        chosen = replace(
            options,
            duration=seconds,
            size=_radius(size, scene),
            start=driver.start,
            obstacles=(
                *([] if floor is None else [Floor(floor)]),
                *(parse_box(each, scene) for each in box or ()),
                *parse_colliders(
                    document,
                    scene,
                    spheres=sphere or (),
                    capsules=capsule or (),
                    planes=plane or (),
                    files=[each for each in colliders or () if each != RIGID_BODIES],
                ),
                *(_rigid_colliders(document, scene, reporter) if RIGID_BODIES in (colliders or ()) else ()),
            ),
            attractors=tuple(parse_attractor(each, scene) for each in attractor or ()),
            max_nodes=None if force or ending in POINT_FORMATS else MAX_NODES,
            max_error=simulation.chosen_bound(max_error, scene, reporter.warn),
        )
        announce_compiling(reporter)
        try:
            run = simulate_particles(scene, driver, emitter, chosen)
            if chosen.max_nodes is not None:  # the exact count: a node rests between two particles
                check_simultaneous(len(run.nodes), chosen.max_nodes)
        except UnsupportedError as error:
            raise error.advise("lower --rate, or --force, or OUT.npz") from None
        if ending in POINT_FORMATS:
            return encode_points(run.points(), fps, ending), run.report, _summary(run.report, has_nodes=False)
        _note_many_nodes(len(run.nodes), form, reporter)
        merged = (number, driver) if merge and number is not None else None
        if number is not None and merged is None:
            note_own_clip(name, driver, number, reporter)
        return add_particles(document, run, name, merged, form.value), run.report, _summary(run.report)

    reporter = Reporter(quiet, verbose)
    simulate_clip(input, output, clip, simulate, reporter, report=report, dry_run=dry_run, others=POINT_FORMATS)


def _summary(report: SimulationReport, *, has_nodes: bool = True) -> str:
    figures = report.figures
    parts = [
        plural(figures["particles"], "particle"),
        *([plural(figures["nodes"], "node")] if has_nodes else []),
        plural(figures["impacts"], "impact"),
        f"{report.duration_s:g} s in steps of 1/{1 / report.step_s:g} s",
    ]
    if report.error_estimate_m and report.error_estimate_m > ROUNDING_M:
        estimated = figures["estimated_particles"]
        of_some = f" ({estimated} particles compared)" if estimated < figures["particles"] else ""
        parts.append(text.format_step_error(report.error_estimate_m) + of_some)
    if report.loop_seam_m is not None:
        parts.append(f"seam of the loop {text.format_length(report.loop_seam_m)}")
    if has_nodes and "max_error_m" in figures:
        parts.append(f"{figures['keys']} keys with an error of {text.format_length(figures['max_error_m'])}")
    return ", ".join(parts)


def _radius(size: str, scene: Scene) -> float:
    """Radius of a particle in m.

    Raises UsageError for one that no file can have, DataRangeError where that is the model's fault: without a size, or
    beyond all numbers.
    """
    radius = units.parse_length(size, "--size", lambda: diagonal(scene))
    if MIN_SIZE_M <= radius <= MAX_SIZE_M:
        return radius
    expected = f"(expected {MIN_SIZE_M:g} to {MAX_SIZE_M:g} m)"
    if not size.rstrip().endswith("%"):
        raise UsageError(f"--size is '{size}' {expected}")
    whole = diagonal(scene)
    problem = f"--size is {size} of the model, whose diagonal is {whole:.3g} m {expected}"
    error = UsageError if MIN_SIZE_M <= whole <= MAX_SIZE_M else DataRangeError
    raise error(problem, help="choose --size, such as 2cm")


def _rigid_colliders(document: Document, scene: Scene, reporter: Reporter) -> list[Obstacle]:
    found, others = read_rigid_colliders(document, scene.skeleton)
    if others:
        more = f" and {plural(len(others) - 1, 'other node')}" if len(others) > 1 else ""
        reporter.warn(
            f"the collider of {scene.skeleton.label(others[0])}{more} is no sphere, box, capsule or plane: left out"
        )
    return found


def _note_many_nodes(count: int, form: Form, reporter: Reporter) -> None:
    if count > MANY_NODES:
        reporter.warn(f"{count} nodes: players take about a second to bind their tracks")
    elif count > MANY_DRAWS and form is Form.NODE:
        reporter.info(f"note: {count} nodes are as many draw calls; --as skin needs one")
