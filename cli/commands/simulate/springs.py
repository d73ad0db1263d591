"""`gltf-anim simulate springs`: hair, tails, ears: secondary motion of joint chains."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, Any

import typer

from anim.arrays import Floats
from anim.errors import UnstableError
from anim.files import resolver
from anim.gltf.authoring import add_clips
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.writing.writer import replace_clips
from anim.measure.continuous_bound.prover import Prover
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.surface import diagonal
from anim.model import Clip, Scene, Skeleton
from anim.operations.selection import Selection
from anim.simulation.registry import SIMULATIONS
from anim.simulation.report import SimulationReport
from anim.simulation.spring_bones.chain_globs import find_chains
from anim.simulation.spring_bones.chains import SpringBones, SpringParameters, check_parameter
from anim.simulation.spring_bones.colliders import Vector
from anim.simulation.spring_bones.json_reader import read_spring_file
from anim.simulation.spring_bones.penetration import deepest_penetration
from anim.simulation.spring_bones.read import read_spring_bones
from anim.simulation.spring_bones.reduction import reduce_keys
from anim.simulation.spring_bones.report import make_report, report_divergence, step_error
from anim.simulation.spring_bones.simulate import SpringOptions, SpringResult, simulate_springs
from anim.units import format_number, plural
from cli import text, units
from cli.errors import UsageError
from cli.io import documents
from cli.options import common, simulation
from cli.options.simulation import parse_seconds
from cli.text import Reporter
from cli.workflows.simulate_clip import simulate_clip

NEW_CLIP = "springs"  # its name, for a file without clips
DEFAULT_FREQUENCY_HZ = 2.5  # of chains named by globs: it looks alike at any size, which stiffness in m/s does not


def command(
    input: common.Input = "-",
    output: common.Output = "-",
    *,
    chain: Annotated[
        list[str] | None,
        typer.Option("--chain", metavar="GLOB", help="First joint of a chain, by name; may be repeated."),
    ] = None,
    springs: Annotated[
        str | None,
        typer.Option("--springs", metavar="FILE", help="Chains and colliders in a .json file."),
    ] = None,
    stiffness: Annotated[
        float | None, typer.Option("--stiffness", metavar="N", help="Speed of return to the rest pose, as in VRM.")
    ] = None,
    drag: Annotated[
        float | None, typer.Option("--drag", metavar="0..1", help="Part of the velocity lost per step, as in VRM.")
    ] = None,
    gravity: Annotated[
        str | None,
        typer.Option("--gravity", metavar="N|X,Y,Z", help="Downwards, or a vector; m/s² with --frequency."),
    ] = None,
    hit_radius: Annotated[
        str | None, typer.Option("--hit-radius", metavar="LENGTH", help="Radius of joints against colliders.")
    ] = None,
    frequency: Annotated[
        float | None,
        typer.Option(
            "--frequency", metavar="HZ", help="Frequency of an oscillator, instead of --stiffness and --drag."
        ),
    ] = None,
    damping_ratio: Annotated[
        float | None,
        typer.Option("--damping-ratio", metavar="N", help="Its damping: 0 for none, 1 is critical."),
    ] = None,
    center: Annotated[
        str | None, typer.Option("--center", metavar="NODE", help="Node in whose space inertia is evaluated.")
    ] = None,
    integrator: Annotated[
        simulation.Integrator | None,
        typer.Option(
            "--integrator",
            help=f"Masses on springs by this method; without it oscillators are exact. {simulation.ABOUT_INTEGRATORS}.",
            show_default=False,
        ),
    ] = None,
    scale_aware: Annotated[
        bool, typer.Option("--scale-aware", help="Scale stiffness, gravity and radii by the nodes' world scale.")
    ] = False,
    clip: simulation.Clip = None,
    step: simulation.Step = SIMULATIONS["springs"].step,
    fps: simulation.Fps = simulation.DEFAULT_FPS,
    duration: simulation.Duration = None,
    warm_up: simulation.WarmUp = 0.0,
    loop: simulation.Loop = False,
    max_error: simulation.MaxError = None,
    report: simulation.ReportFile = None,
    dry_run: common.DryRun = False,
    quiet: common.Quiet = False,
    verbose: common.Verbose = False,
) -> None:
    """Simulate the secondary motion of hair, tails and ears, and write it as rotation tracks of the clip.

    Chains and colliders are those of the file (VRMC_springBone with extended colliders and angle limits, or VRM 0.x),
    of a .json file, or the joints below --chain, which swing at 2.5 Hz without --stiffness, --drag or --frequency.
    Parameters given as options replace those of all chains. Rotation tracks of the joints are replaced, others stay.

    VRM's drag is per step, so players show the motion of 1/60 s: another --step is another motion. With --frequency
    each joint is a damped oscillator instead, solved exactly, and stable at every step. Its damping is relative to the
    parent: a joint arrives with the parent's speed, so where that stops at once even --damping-ratio 1 passes the rest
    pose once, by speed / (e · angular frequency). With --integrator it is a mass on a spring: bones stretch, and a step
    that is too long diverges; --report springs.png compares every integrator on these chains.

    --loop runs the clip until the motion repeats within 0.1 mm, or else blends the last 0.2 s; its step is the nearest
    that divides the clip. --scale-aware moves a scaled model by the angles of the model without scale.
    """
    if frequency is not None and (stiffness is not None or drag is not None):
        raise UsageError("--frequency replaces --stiffness and --drag (expected one or the other)")
    if damping_ratio is not None and frequency is None and not chain:
        raise UsageError("--damping-ratio needs --frequency")
    reporter = Reporter(quiet, verbose)
    options = SpringOptions(
        duration,
        parse_seconds(step, "--step"),
        warm_up,
        loop,
        fps,
        "" if integrator is None else integrator.value,
        scale_aware,
    )
    given = {"stiffness": stiffness, "drag": drag, "frequency": frequency, "damping_ratio": damping_ratio}
    changes: dict[str, Any] = {key: value for key, value in given.items() if value is not None}
    if gravity is not None:
        changes["gravity"] = _gravity(gravity)
    for name, value in changes.items():  # before the file is read, and by the options' names
        check_parameter(name, value, f"--{name.replace('_', '-')}")

    def simulate(
        document: Document, scene: Scene, driver: Clip, number: int | None
    ) -> tuple[Document, SimulationReport, str]:
        if loop and duration is not None and driver.tracks:
            raise UsageError("--loop closes the whole clip (expected no --duration)")
        if hit_radius is not None:
            changes["hit_radius"] = units.parse_length(hit_radius, "--hit-radius", lambda: diagonal(scene))
        timed = replace(options, duration=simulation.chosen_duration(duration, driver))
        is_vrm = stiffness is not None or drag is not None
        own = SpringParameters(frequency=None if is_vrm else DEFAULT_FREQUENCY_HZ)
        bones = _chains(document, scene.skeleton, chain or [], springs, center, own).with_parameters(**changes)
        try:
            result = simulate_springs(scene.skeleton, driver, bones, timed)
        except UnstableError as gone:
            raise report_divergence(scene.skeleton, bones, timed, gone) from None
        for note in _notes(result, scene.skeleton, timed):
            reporter.info(f"note: {note}")
        prover = Prover(ErrorMetric(scene)) if max_error is not None or report is not None else None
        error = depth = None
        if prover is not None and report is not None and result.joints:  # all can be without length
            error = step_error(prover, scene.skeleton, driver, bones, timed, result)
            depth = deepest_penetration(scene.skeleton, result.clip, bones, _key_times(result))
        reduced = ""
        if prover is not None and max_error is not None:
            bound = units.parse_bound(max_error, "--max-error", lambda: prover.ruler.diagonal, reporter.warn)
            result, reduced = _reduce(result, prover, bound)
        found = make_report(scene.skeleton, bones, timed, result, error, depth)
        return _written(document, result.clip, number), found, _summary(found, result) + reduced

    simulate_clip(input, output, clip, simulate, reporter, report=report, dry_run=dry_run)


def _chains(
    document: Document,
    skeleton: Skeleton,
    globs: list[str],
    file: str | None,
    center: str | None,
    parameters: SpringParameters,
) -> SpringBones:
    """The chains that the options name, or else those of the file. parameters: of the chains named by globs."""
    joints = {int(joint) for _, skin in reader.skins(document) for joint in skin.joints}
    bones = SpringBones(())
    if file is not None:
        with documents.content(file, ending=".json", read=resolver.read_options) as (data, _):
            bones = read_spring_file(data.tobytes(), skeleton, skin_joints=joints, has_chains=not globs)
    elif not globs:
        bones = read_spring_bones(document)
    middle = _center(skeleton, center)
    if globs:
        colliders = tuple(range(len(bones.colliders)))
        new = find_chains(skeleton, globs, parameters, skin_joints=joints, colliders=colliders, center=middle)
        bones = replace(bones, chains=(*bones.chains, *new))
    if middle is not None:
        bones = replace(bones, chains=tuple(replace(each, center=middle) for each in bones.chains))
    return bones


def _center(skeleton: Skeleton, glob: str | None) -> int | None:
    if glob is None:
        return None
    found = Selection((), (glob,)).chosen_nodes(skeleton)
    if len(found) > 1:
        raise UsageError(f"--center '{glob}' matches {len(found)} nodes (expected one)")
    return found[0]


def _gravity(given: str) -> Vector:
    try:
        values = [float(each) for each in given.split(",")]
    except ValueError:
        values = []
    if len(values) not in (1, 3):
        raise UsageError(f"--gravity is '{given}' (expected a number, or three with commas between)")
    return (0.0, -values[0], 0.0) if len(values) == 1 else (values[0], values[1], values[2])


def _notes(result: SpringResult, skeleton: Skeleton, options: SpringOptions) -> Iterator[str]:
    yield from result.notes
    if result.replaced:
        first, more = skeleton.label(result.replaced[0]), len(result.replaced) - 1
        others = f" and of {plural(more, 'other joint')}" if more else ""
        yield f"the rotation track of {first}{others} is replaced"
    if abs(result.step - options.step) > 1e-9 * options.step:
        yield f"the step is 1/{1 / result.step:.4g} s, so that {result.num_steps} steps are the loop"


def _reduce(result: SpringResult, prover: Prover, bound: float) -> tuple[SpringResult, str]:
    before = _num_keys(result)
    clip, proof = reduce_keys(prover, result.clip, result.joints, max_error=bound)
    reduced = replace(result, clip=clip)
    error = text.format_length(proof.error.max_error)
    return reduced, f", {before} → {_num_keys(reduced)} keys with an error of {error}"


def _key_times(result: SpringResult) -> Floats:
    return next(t.times for t in result.clip.tracks if t.path == "rotation" and t.node in result.joints)


def _num_keys(result: SpringResult) -> int:
    joints = set(result.joints)
    return sum(len(track.times) for track in result.clip.tracks if track.path == "rotation" and track.node in joints)


def _written(document: Document, clip: Clip, number: int | None) -> Document:
    if number is None:
        return add_clips(document, [replace(clip, name=NEW_CLIP)])
    return replace_clips(document, {number: clip})


def _summary(report: SimulationReport, result: SpringResult) -> str:
    parts = [
        plural(report.figures["chains"], "chain"),
        plural(report.figures["joints"], "joint"),
        plural(report.figures["colliders"], "collider"),
        f"{report.duration_s:.4g} s in steps of 1/{1 / report.step_s:.4g} s",
        f"largest rotation {format_number(report.figures['max_rotation_deg'], 2)}°",
    ]
    if result.loop is not None and result.loop.settled:
        parts.append(f"loop after {result.loop.rounds} rounds, seam {text.format_length(result.loop.seam)}")
    elif result.loop is not None:
        parts.append(
            f"no loop after {result.loop.rounds} rounds: a seam of {text.format_length(result.loop.seam)} is blended"
        )
    if report.error_estimate_m is not None and report.omega_h is not None:  # VRM: another motion, not an error
        parts.append(text.format_step_error(report.error_estimate_m))
    return ", ".join(parts)
