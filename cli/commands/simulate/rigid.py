"""`gltf-anim simulate rigid`: bodies that fall, collide and come to rest."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from typing import Annotated

import typer

from anim.gltf.document import Document
from anim.gltf.validation.extensions import PHYSICS
from anim.model import Clip, Scene
from anim.operations.selection import Selection
from anim.simulation.registry import SIMULATIONS
from anim.simulation.report import SimulationReport
from anim.simulation.rigid_bodies.description import WATER_KG_M3, Material, Motion, PhysicsDescription
from anim.simulation.rigid_bodies.node_globs import SHAPES, ChosenNodes, add_chosen, split_by_mesh
from anim.simulation.rigid_bodies.options import SETTLED_M, RigidOptions
from anim.simulation.rigid_bodies.simulate import (
    add_rigid_motion,
    read_description,
    simulate_rigid_bodies,
)
from anim.units import plural
from cli import text
from cli.errors import UsageError
from cli.options import common, simulation
from cli.options.simulation import name_option, parse_seconds, parse_vector
from cli.text import Reporter
from cli.workflows.simulate_clip import note_own_clip, simulate_clip

ROUNDING_M = 1e-6  # float32 of a body some metres from the center
Shape = StrEnum("Shape", [(name, name) for name in SHAPES])  # type: ignore[misc]
HULL = Shape("hull")


def command(
    input: common.Input = "-",
    output: common.Output = "-",
    *,
    body: Annotated[
        list[str] | None,
        typer.Option("--body", metavar="GLOB", help="Nodes that become bodies, with all meshes below; repeatable."),
    ] = None,
    shape: Annotated[
        Shape, typer.Option("--shape", help="Shape of each mesh of --body: its hull, box, sphere, or itself.")
    ] = HULL,
    collider: Annotated[
        list[str] | None,
        typer.Option("--collider", metavar="GLOB", help="Nodes that bodies collide with, static or animated."),
    ] = None,
    density: Annotated[float, typer.Option("--density", metavar="N", help="Density in kg/m³.")] = WATER_KG_M3,
    friction: simulation.Friction = 0.6,
    restitution: simulation.Restitution = 0.0,
    velocity: Annotated[
        list[str] | None,
        typer.Option("--velocity", metavar="GLOB=X,Y,Z", help="Velocity of bodies at the start, in m/s; repeatable."),
    ] = None,
    floor: simulation.FloorHeight = None,
    gravity: simulation.Gravity = simulation.EARTH_GRAVITY,
    step: simulation.Step = SIMULATIONS["rigid"].step,
    fps: simulation.Fps = simulation.DEFAULT_FPS,
    duration: simulation.Duration = None,
    warm_up: simulation.WarmUp = 0.0,
    loop: simulation.Loop = False,
    max_error: simulation.MaxError = None,
    clip: simulation.Clip = None,
    merge: simulation.Merge = False,
    name: simulation.Name = "rigid",
    report: simulation.ReportFile = None,
    dry_run: common.DryRun = False,
    quiet: common.Quiet = False,
    verbose: common.Verbose = False,
) -> None:
    """Let rigid bodies fall, collide and come to rest.

    Bodies are nodes named by --body, and those of KHR_physics_rigid_bodies or OMI_physics_body in the file, with their
    colliders, materials, filters, joints and motors. Colliders that the driving clip moves push bodies. Impacts get
    keys at their own time between frames; a body that sleeps has no more keys. --loop repeats the driving clip until
    the bodies repeat their motion within 0.1 mm, at most 20 times; then the last 0.2 s lead back to the start. The same
    file and options give the same bytes on the same kind of processor. Requires rapier3d: pip install
    'gltf-anim[physics]'.
    """
    simulation.check_fps(fps)
    options = RigidOptions(
        parse_vector(gravity, "--gravity"),
        parse_seconds(step, "--step"),
        fps,
        warm_up=warm_up,
        loop=loop,
        estimate_error=report is not None,
    )
    material = Material(friction, friction, restitution)
    reporter = Reporter(quiet, verbose)

    def simulate(
        document: Document, scene: Scene, driver: Clip, number: int | None
    ) -> tuple[Document, SimulationReport, str]:
        description = read_description(document, scene.skeleton)
        bodies, without_mesh = split_by_mesh(scene, _nodes(scene, body))
        if without_mesh:
            names = plural(len(without_mesh), "node")
            reporter.info(f"note: {names} of --body without a mesh of their own are no bodies")
        with name_option("--density", f"{density:g}"):
            motion = Motion(density=density, follows_clip=False)
        chosen = ChosenNodes(bodies, shape.value, _nodes(scene, collider), motion, material)
        description = replace(add_chosen(description, scene, chosen), floor=floor, floor_material=material)
        description = _with_velocities(description, scene, velocity or [])
        seconds = simulation.chosen_duration(duration, driver, simulation.RIGID_DURATION_S)
        error = simulation.chosen_bound(max_error, scene, reporter.warn)
        run = simulate_rigid_bodies(scene, driver, description, replace(options, duration=seconds, max_error=error))
        for note in run.notes:
            reporter.warn(note)
        merged = (number, driver) if merge and number is not None else None
        if number is not None and merged is None:
            note_own_clip(name, driver, number, reporter)
        return add_rigid_motion(document, run, name, merged), run.report, _summary(run.report)

    simulate_clip(input, output, clip, simulate, reporter, report=report, dry_run=dry_run, uses=PHYSICS)


def _nodes(scene: Scene, globs: list[str] | None) -> tuple[int, ...]:
    return tuple(sorted(Selection((), globs).chosen_nodes(scene.skeleton))) if globs else ()


def _with_velocities(description: PhysicsDescription, scene: Scene, given: list[str]) -> PhysicsDescription:
    motions = dict(description.motions)
    for each in given:
        glob, equals, numbers = each.rpartition("=")
        if not equals:
            raise UsageError(f"--velocity is '{each}' (expected GLOB=X,Y,Z)")
        velocity = parse_vector(numbers, "--velocity")
        nodes = set(_nodes(scene, [glob])) & motions.keys()
        if not nodes:
            raise UsageError(f"--velocity '{glob}' names no body")
        for node in nodes:
            with name_option("--velocity", each):
                motions[node] = replace(motions[node], linear_velocity=velocity, velocity_in_world=True)
    return replace(description, motions=motions)


def _summary(report: SimulationReport) -> str:
    figures = report.figures
    parts = [
        f"{figures['bodies']} {'body' if figures['bodies'] == 1 else 'bodies'}",
        plural(figures["impacts"], "impact"),
        plural(figures["keys"], "key"),
        f"{report.duration_s:g} s in steps of 1/{1 / report.step_s:g} s",
    ]
    if report.loop_seam_m is not None:
        rounds, seam = plural(figures["loop_rounds"], "round"), text.format_length(report.loop_seam_m)
        settled = report.loop_seam_m < SETTLED_M
        parts.append(
            f"loop after {rounds}, seam {seam}" if settled else f"no loop after {rounds}: a seam of {seam} is blended"
        )
    if report.error_estimate_m and report.error_estimate_m > ROUNDING_M:
        amplified = ", amplified by each impact" if figures["impacts"] else ""
        parts.append(text.format_step_error(report.error_estimate_m) + amplified)
    return ", ".join(parts)
