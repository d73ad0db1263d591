"""`gltf-anim simulate cloth`: a mesh, or a part of one, as cloth."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from enum import StrEnum
from typing import Annotated, Any

import numpy as np
import typer

from anim.arrays import Bools
from anim.caches import registry
from anim.caches.transforms import statistics, up_axis
from anim.errors import UnstableError
from anim.gltf.document import Document, json_array
from anim.gltf.reading import reader
from anim.model import MeshPart, Scene, VertexCache
from anim.simulation.cloth.model import Fabric
from anim.simulation.cloth.options import SOLVERS, ClothOptions
from anim.simulation.cloth.selection import select_vertices
from anim.simulation.cloth.simulate import ClothRun, simulate_cloth
from anim.simulation.cloth.solver import Environment
from anim.simulation.registry import SIMULATIONS
from anim.simulation.report import describe_elongation
from anim.simulation.steps import count_substeps
from anim.units import format_number, plural
from cli import text, units
from cli.errors import CheckError, UsageError
from cli.io import cache_files, documents, scenes
from cli.options import caches, common, meshes, simulation
from cli.options.simulation import parse_seconds, parse_vector
from cli.progress import announce_compiling
from cli.reports import image_notes
from cli.text import Reporter
from cli.workflows.bake_clip import Output, keeps_materials, onto_source
from cli.workflows.colliders import parse_colliders
from cli.workflows.simulate_clip import NO_CLIP, driving_clip, note_chosen_clip
from cli.workflows.simulation_report import check_report, commit_report_after, write_report

Solver = StrEnum("Solver", [(name, name) for name in SOLVERS])  # type: ignore[misc]
XPBD, MASS_SPRING = Solver("xpbd"), Solver("mass-spring")
MIN_ELONGATION = 0.05  # beyond, its cause is stated
SELECTOR = "x-min … z-max, joint:GLOB, weight:GLOB,MIN, material:GLOB or box:X,Y,Z,SX,SY,SZ"


def command(
    input: common.Input = "-",
    output: caches.Product = "-",
    *,
    mesh: meshes.Meshes = None,
    cloth: Annotated[
        list[str] | None,
        typer.Option("--cloth", metavar="WHICH", help=f"Only these vertices are cloth: {SELECTOR}; may be repeated."),
    ] = None,
    pin: Annotated[
        list[str] | None,
        typer.Option("--pin", metavar="WHICH", help="Vertices that follow the animation, chosen as by --cloth."),
    ] = None,
    density: Annotated[float, typer.Option("--density", metavar="KG/M2", help="Mass per area.")] = 0.2,
    stretch_compliance: Annotated[
        float, typer.Option("--stretch-compliance", metavar="M/N", help="Compliance of edges; 0 is rigid.")
    ] = 1e-7,
    bend_compliance: Annotated[
        float, typer.Option("--bend-compliance", metavar="M/N", help="Compliance of hinges; 0 is rigid.")
    ] = 1e-2,
    damping: Annotated[
        float,
        typer.Option(
            "--damping", metavar="N", help="Damping per second; springs of mass-spring have 2 % of critical besides."
        ),
    ] = 0.3,
    gravity: simulation.Gravity = simulation.EARTH_GRAVITY,
    wind: simulation.Wind = "0,0,0",
    gusts: Annotated[
        float, typer.Option("--gusts", metavar="N", help="Gusts, as a fraction of the wind.", min=0)
    ] = 0.3,
    floor: simulation.FloorHeight = None,
    sphere: simulation.Spheres = None,
    capsule: simulation.Capsules = None,
    plane: simulation.Planes = None,
    colliders: simulation.Colliders = None,
    thickness: Annotated[
        str, typer.Option("--thickness", metavar="LENGTH", help="Distance that is kept from colliders.")
    ] = "5mm",
    friction: simulation.Friction = 0.3,
    self_collision: Annotated[bool, typer.Option("--self-collision", help="Keep vertices of the cloth apart.")] = False,
    solver: Annotated[Solver, typer.Option("--solver", help="Method; mass-spring needs --integrator.")] = XPBD,
    integrator: simulation.IntegratorOption = simulation.VELOCITY_VERLET,
    stiffness: Annotated[
        float, typer.Option("--stiffness", metavar="N/M", help="Stiffness of an edge, for mass-spring.")
    ] = 500.0,
    iterations: Annotated[
        int, typer.Option("--iterations", metavar="N", help="Iterations per step, for relaxation.", min=1)
    ] = 20,
    max_stretch: Annotated[
        str | None,
        typer.Option(
            "--max-stretch",
            metavar="FRACTION",
            help="Halve the step until no edge is stretched by more at any frame, such as 5%; else exit 6.",
        ),
    ] = None,
    tethers: Annotated[
        bool, typer.Option("--tethers/--no-tethers", help="Limit distances to pinned vertices along the mesh.")
    ] = True,
    step: simulation.Step = SIMULATIONS["cloth"].step,
    fps: simulation.Fps = simulation.DEFAULT_FPS,
    duration: simulation.Duration = None,
    warm_up: simulation.WarmUp = 0.0,
    loop: simulation.Loop = False,
    seed: simulation.Seed = 0,
    clip: simulation.Clip = None,
    report: simulation.ReportFile = None,
    format: caches.FormatOption = None,
    up: caches.UpOption = None,
    max_error: caches.MaxError = None,
    max_targets: caches.MaxTargets = None,
    quantize: caches.Quantize = False,
    layout: caches.LayoutOption = None,
    dry_run: common.DryRun = False,
    quiet: common.Quiet = False,
    verbose: common.Verbose = False,
) -> None:
    """Simulate a mesh as cloth, and write a vertex cache or a .glb with morph targets.

    Vertices chosen by --pin, and all but those of --cloth, follow the clip at every step; the others keep the lengths
    of the mesh's edges, and are moved by gravity, wind, colliders and the floor. xpbd is stiff at any step.
    mass-spring and relaxation are the classic methods, to see what a step that is too long does: --report
    stability.png draws the cloth by every solver and integrator. Colliders move with their nodes at every step.
    --self-collision takes about five times as long.
    """
    reporter = Reporter(quiet, verbose)
    began = time.perf_counter()
    simulation.check_fps(fps)
    kind = check_report(report)
    ending = cache_files.check(output, None if format is None else f".{format}")
    given: dict[str, Any] = {"quantize": quantize, "layout": layout, "max_targets": max_targets}
    writing = caches.write_options(ending, given | {"max_error": max_error})
    substeps = count_substeps(fps, parse_seconds(step, "--step"))
    limit = None if max_stretch is None else units.parse_fraction(max_stretch, "--max-stretch")
    with documents.source(input, reporter) as source:
        document = source.document
        scene = scenes.read_scene(document, source.name, reporter)
        number = driving_clip(document, clip)
        if loop and duration is not None and number is not None:
            raise UsageError("--loop closes the whole clip (expected no --duration)")
        driver = NO_CLIP if number is None else reader.clips(document)[number]
        node = _mesh_node(scene, mesh)
        options = ClothOptions(
            Fabric(
                density,
                stretch_compliance,
                bend_compliance,
                damping,
                units.parse_length(thickness, "--thickness", lambda: 1.0),
                friction,
            ),
            Environment(
                parse_vector(gravity, "--gravity"), parse_vector(wind, "--wind"), gusts, floor=floor, seed=seed
            ),
            parse_colliders(
                document, scene, spheres=sphere or (), capsules=capsule or (), planes=plane or (), files=colliders or ()
            ),
            solver.value,
            integrator.value,
            substeps,
            iterations,
            limit,
            stiffness,
            self_collision,
            tethers,
            fps,
            simulation.chosen_duration(duration, driver),
            warm_up,
            loop,
            estimate_error=kind == "json",
        )
        registry.check_frames(ending, options.num_frames, _num_vertices(scene, node), writing)
        pinned = _pinned(document, scene, node, cloth, pin)
        announce_compiling(reporter)
        try:
            run = simulate_cloth(scene, driver, node, pinned, options)
        except UnstableError as error:
            if report is not None and error.report is not None and not dry_run:
                write_report(error.report, report)
            raise
        note_chosen_clip(document, clip, reporter)
    excess = describe_elongation(run.report.worst_stretch, run.report.figures["substeps"], limit)
    if excess:
        if report is not None and not dry_run:
            write_report(run.report, report)
        raise CheckError(excess, help=run.report.advice)
    cache = run.cache if up is None else up_axis.to_up_axis(run.cache, str(up))
    meters = None
    if max_error is not None:
        meters = units.parse_bound(max_error, "--max-error", lambda: statistics.diagonal(cache), reporter.warn)
    if keeps_materials(ending):
        cache, given["source"] = onto_source(
            _as_part(cache, scene, node), source, number, output=Output(output, ending, dry_run)
        )
    with commit_report_after(run.report, report, dry_run=dry_run):
        saved = cache_files.save(
            cache, output, caches.write_options(ending, given | {"max_error": meters}), ending=ending, dry_run=dry_run
        )
    saved.report(reporter)
    if ending == ".gltf" and not dry_run:
        image_notes.report(document, source, output, reporter)
    name = "stdout" if output == documents.PIPE else output
    took = text.format_duration(time.perf_counter() - began)
    dry = " (dry run: nothing written)" if dry_run else ""
    reporter.info(f"{name}  {text.format_bytes(saved.size)}, {_summary(run, substeps)}, {took}{dry}")
    if not pinned.any():
        reporter.warn("no vertex is pinned: all of the mesh falls (--pin or --cloth keeps some)")
    if run.report.advice:
        reporter.warn(run.report.advice)


def _as_part(cache: VertexCache, scene: Scene, node: int) -> VertexCache:
    """The cache with the primitives of its mesh, which name the vertices of the source."""
    mesh = next(each.mesh for each in scene.instances if each.node == node)
    parts, vertex, face = [], 0, 0
    for each in mesh.primitives:
        ends = vertex + each.vertices, face + each.faces
        if each.vertices:
            parts.append(MeshPart(mesh.name, (vertex, ends[0]), (face, ends[1]), node, each.material))
        vertex, face = ends
    return replace(cache, parts=tuple(parts))


def _summary(run: ClothRun, substeps: int) -> str:
    figures: dict[str, Any] = dict(run.report.figures)
    worst = run.report.worst_stretch or {}
    chosen = " (chosen for --max-stretch)" if figures["substeps"] != substeps else ""
    parts = [
        f"{plural(run.cache.frame_count, 'frame')} of {figures['points']} points ({figures['pinned']} pinned)",
        f"{figures['solver']}, steps of 1/{1 / run.report.step_s:g} s{chosen}",
        _stretch(worst),
    ]
    if run.report.penetration_m:
        parts.append(f"{text.format_length(run.report.penetration_m)} inside a collider or below the floor at most")
    if run.report.loop_seam_m is not None:
        parts.append(_loop(figures["loop_rounds"], run.report.loop_seam_m, settled=figures["loop_settled"]))
    return ", ".join(parts)


def _stretch(worst: Mapping[str, Any]) -> str:
    """The largest elongation and its cause, and apart that of edges without pinned ends if others are longer."""
    cause = ", by the clip's first pose" if worst["time_s"] == 0 and worst["fraction"] > MIN_ELONGATION else ""
    words = f"stretched by {format_number(100 * worst['fraction'], 2)} % at most, at {worst['time_s']:.2f} s{cause}"
    if worst["attached_edges"] > max(2 * worst["free_edges"], MIN_ELONGATION):
        words += f" (edges without pinned ends by {format_number(100 * worst['free_edges'], 2)} %"
        forced = worst["attachment"] if worst["attachment"] > MIN_ELONGATION else 0.0
        words += f"; the clip moves pinned ends apart by {format_number(100 * forced, 2)} %)" if forced else ")"
    return words


def _loop(rounds: int, seam: float, *, settled: bool) -> str:
    if settled:
        return f"loop after {rounds} rounds, seam {text.format_length(seam)}"
    return f"no loop after {rounds} rounds: a seam of {text.format_length(seam)} is blended"


def _mesh_node(scene: Scene, mesh: list[str] | None) -> int:
    """Node of the one mesh that is cloth."""
    chosen = meshes.nodes(scene, mesh)
    nodes = [each.node for each in scene.instances if chosen is None or each.node in chosen]
    if len(nodes) != 1:
        names = ", ".join(f"'{each.mesh.name or f'#{each.node}'}'" for each in scene.instances[:8])
        raise UsageError(f"{len(nodes)} meshes are chosen (expected one)", help=f"choose with --mesh: {names}")
    return nodes[0]


def _num_vertices(scene: Scene, node: int) -> int:
    return sum(len(each.mesh.positions) for each in scene.instances if each.node == node)


def _pinned(document: Document, scene: Scene, node: int, cloth: list[str] | None, pin: list[str] | None) -> Bools:
    """Vertices (V,) that follow the animation."""
    instance = next(each for each in scene.instances if each.node == node)
    positions = instance.mesh.positions
    materials = [str(each.get("name", "")) for each in json_array(document.json, "materials")]

    def select(which: list[str]) -> Bools:
        found = [select_vertices(each, instance, positions, scene.skeleton.names, materials) for each in which]
        return np.asarray(np.logical_or.reduce([np.zeros(len(positions), bool), *found]))

    pinned = select(pin or [])
    return pinned | ~select(cloth) if cloth else pinned
