"""`gltf-anim optimize`: fewer bytes, within an error that is measured on the written file."""

from __future__ import annotations

import os
import re
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum
from pathlib import Path, PurePath
from typing import Annotated

import numpy as np
import typer

from anim.errors import AnimError
from anim.gltf import read
from anim.gltf.accessors import Accessors
from anim.gltf.document import Document
from anim.measure.surface import diagonal
from anim.model import Scene
from anim.ops.selection import Selection
from anim.optimize.limits import EFFORTS, Bounds, Drop, Objective, Packing, Policy, Reference
from anim.optimize.optimize import Optimized
from anim.optimize.optimize import optimize as optimized
from anim.optimize.request import Request
from anim.optimize.tradeoff import Sized, curve, fitting
from anim.optimize.verify import PLAYERS
from cli import optimization, options, streams, units
from cli.errors import CheckError, UsageError
from cli.progress import Progress
from cli.report import Voice


class Meshopt(StrEnum):
    """Which extension compresses the numbers."""

    EXT = "ext"
    KHR = "khr"


class Player(StrEnum):
    """Who must show the motion within the bound."""

    ANY = "any"
    SPEC = "spec"


Effort = StrEnum("Effort", [(name, name) for name in EFFORTS])  # type: ignore[misc]
BALANCED = Effort("balanced")
ZERO = re.compile(r"\s*0+(\.0*)?\s*(%|m|cm|mm|um|µm)?\s*")
BYTES = {"": 1, "b": 1, "kb": 1000, "mb": 1_000_000, "kib": 1024, "mib": 1 << 20}


def optimize(
    input: options.Input = "-",
    output: options.Output = "-",
    *,
    max_error: Annotated[
        str,
        typer.Option("--max-error", metavar="LENGTH", help="How far any vertex may move: 0.5mm, 0.01% of the size, 0."),
    ] = "0.01%",
    max_bytes: Annotated[
        str | None,
        typer.Option("--max-bytes", metavar="N", help="Instead: the smallest error for a file of 800kB at most."),
    ] = None,
    meshopt: Annotated[
        Meshopt | None,
        typer.Option("--meshopt", help="Compress too: EXT_ or KHR_meshopt_compression.", show_default=False),
    ] = None,
    drop: Annotated[
        Drop,
        typer.Option("--drop", help="Channels at rest that may go: in each clip; if in all clips; none."),
    ] = Drop.UNUSED,
    rebase_rest: Annotated[
        bool, typer.Option("--rebase-rest", help="Move the rest pose to where most clips hold it.")
    ] = False,
    drop_invisible: Annotated[
        bool, typer.Option("--drop-invisible", help="Drop channels of nodes that move no vertex.")
    ] = False,
    keep_node: Annotated[
        list[str] | None,
        typer.Option("--keep-node", metavar="GLOB", help="Leave the motion of these nodes exact; may be repeated."),
    ] = None,
    reference: Annotated[
        Reference, typer.Option("--reference", help="Stay near the motion at every moment, or at its keys.")
    ] = Reference.CURVE,
    shell: Annotated[
        str, typer.Option("--shell", metavar="LENGTH", help="How far around nodes without vertices errors count.")
    ] = "1%",
    max_pointer_error: Annotated[
        str, typer.Option("--max-pointer-error", metavar="SHARE", help="Of the range of tracks that move no node.")
    ] = "0.01%",
    max_angle: Annotated[
        str | None, typer.Option("--max-angle", metavar="ANGLE", help="No node may be turned by more: 0.5deg.")
    ] = None,
    max_speed_error: Annotated[
        str | None,
        typer.Option("--max-speed-error", metavar="LENGTH", help="Per second, of any vertex: 5mm (against jitter)."),
    ] = None,
    player: Annotated[
        Player, typer.Option("--player", help="The bound holds in any player, or in those that slerp as glTF says.")
    ] = Player.ANY,
    objective: Annotated[
        Objective, typer.Option("--objective", help="Fewest bytes as a file, or after gzip.")
    ] = Objective.FILE,
    effort: Annotated[Effort, typer.Option("--effort", help="How long to search.")] = BALANCED,
    jobs: Annotated[int, typer.Option("--jobs", "-j", metavar="N", min=0, help="Processes; 0: one per core.")] = 0,
    report: Annotated[
        str | None, typer.Option("--report", metavar="FILE", help="Write all figures as JSON, '-' for stdout.")
    ] = None,
    curve_file: Annotated[
        str | None,
        typer.Option("--curve", metavar="FILE", help="Size against error as .csv, .png or .svg; writes no glTF then."),
    ] = None,
    clip: options.Clips = None,
    dry_run: options.DryRun = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
) -> None:
    """Make animations smaller, within an error that no vertex exceeds.

    The bound is kept on every skinned and morphed vertex at every time, in players that slerp and in those that mix
    quaternions by components, and it is measured on the bytes that are written. Where it can't be kept nothing is
    written (exit 6). Start and end of each clip stay exact; every clip stays; STEP stays STEP. Channels that do nothing
    go, constants become one key, equal data is shared, keys and time axes are chosen together, rotations become int16.
    The same command on its own output changes nothing.
    """
    began = time.perf_counter()
    voice = Voice(quiet, verbose)
    _check_outputs(output, report, curve_file, dry_run=dry_run)
    with streams.source(input) as source:
        document = source.document
        accessors = Accessors(document)
        clips, scene = read.clips(document, accessors), _scene(document, accessors, voice)
        scale = diagonal(scene)
        chosen = Selection(clip or ()).chosen_clips(read.names(document))
        request = Request(
            Bounds(
                _length(max_error, "--max-error", scale),
                _length(shell, "--shell", scale),
                0.0 if max_pointer_error in ("0", "0%") else units.share(max_pointer_error, "--max-pointer-error"),
                None if max_angle is None else units.angle(max_angle, "--max-angle"),
                None if max_speed_error is None else _length(max_speed_error, "--max-speed-error", scale),
            ),
            Policy(drop, reference, rebase_rest, drop_invisible, _kept(keep_node, scene)),
            Packing.CORE if meshopt is None else Packing(meshopt.value),
            objective,
            str(effort),
            PLAYERS if player is Player.ANY else ("spec",),
        )
        workers = jobs or os.cpu_count() or 1
        progress = Progress("optimize", 1000, shown=not quiet)

        def run(request: Request) -> Optimized:
            found = optimized(
                document,
                scene,
                clips,
                request,
                chosen=chosen,
                workers=workers if optimization.is_long(clips, chosen) else 1,
                detailed=report is not None or verbose,
                start="fork" if sys.platform == "linux" else "spawn",
                progress=lambda share: progress(round(1000 * share)),
            )
            progress.close()
            return found

        if curve_file is not None:
            _draw_curve(document, request, scale, run, curve_file, output, source.folder, voice)
            return
        if max_bytes is not None:
            request = _fitted(document, request, scale, run, _bytes(max_bytes), output, source.folder)
        found = run(request)
        optimization.check(found, clips, request, scale)
        result = optimization.smaller(found, document, lambda each: _size(each, output, source.folder))
        size = streams.write(result, output, source.folder, dry_run=dry_run)
        name = source.name if output == streams.PIPE else output
        about = optimization.About(
            name, document, result, clips, found, request, scale, source.size, size, time.perf_counter() - began
        )
        for line in optimization.lines(about, dry_run=dry_run):
            voice.say(line)
        for line in optimization.details(about) if verbose else ():
            voice.detail(line)
        if report is not None:
            streams.write_text(optimization.as_json(about), report)


def _check_outputs(output: str, report: str | None, curve_file: str | None, *, dry_run: bool) -> None:
    """Refuse at once what can't be written."""
    if curve_file is not None:
        streams.check_file(curve_file)
        if PurePath(curve_file).suffix.lower() not in (".csv", ".png", ".svg"):
            raise UsageError(f"{curve_file}: is no .csv, .png or .svg file")
    elif not dry_run:
        streams.check_output(output)
    if report is not None and report != streams.PIPE:
        streams.check_file(report)
    if report == output == streams.PIPE and curve_file is None and not dry_run:
        raise UsageError("--report and OUT can't both be stdout")


def _scene(document: Document, accessors: Accessors, voice: Voice) -> Scene:
    try:
        return read.scene(document, accessors)
    except AnimError as error:  # vertices that can't be read leave the nodes to be measured
        voice.say(f"note: measured at nodes, not on the surface: {error}")
        return Scene(read.skeleton(document), ())


def _length(text: str, option: str, scale: float) -> float:
    """Metres, 0 allowed."""
    if ZERO.fullmatch(text):
        return 0.0
    return units.meters(text, option, lambda: scale)


def _kept(globs: list[str] | None, scene: Scene) -> frozenset[int]:
    return frozenset(Selection((), globs).chosen_nodes(scene.skeleton)) if globs else frozenset()


def _bytes(text: str) -> int:
    """A number of bytes: 800kB, 1.5 MB, 65536."""
    number = text.strip().lower().rstrip("bkmi ")
    unit = text.strip().lower()[len(number) :].strip()
    try:
        count = int(float(number) * BYTES[unit])
    except (ValueError, KeyError):
        count = 0
    if count <= 0:
        raise UsageError(f"--max-bytes is '{text}' (expected a size like 800kB, 1.5MB or 65536)")
    return count


def _size(document: Document, output: str, folder: Path | None) -> int:
    return streams.write(document, output, folder, dry_run=True)


def _sizer(
    document: Document, request: Request, run: Callable[[Request], Optimized], output: str, folder: Path | None
) -> Callable[[float], Sized]:
    """What makes sizes of bounds, fast."""

    def tried(max_error: float) -> Sized:
        found = run(replace(request, bounds=replace(request.bounds, max_error=max_error), effort="fast"))
        smallest = optimization.smaller(found, document, lambda each: _size(each, output, folder))
        return Sized(max_error, _size(smallest, output, folder), optimization.worst(found))

    return tried


def _fitted(
    document: Document,
    request: Request,
    scale: float,
    run: Callable[[Request], Optimized],
    max_bytes: int,
    output: str,
    folder: Path | None,
) -> Request:
    """The request with the smallest bound that fits."""
    found = fitting(max_bytes, scale, _sizer(document, request, run, output, folder))
    if found is None:
        raise CheckError(f"doesn't fit {max_bytes} bytes, however large the error: all else in the file takes too much")
    return replace(request, bounds=replace(request.bounds, max_error=found.max_error))


def _draw_curve(
    document: Document,
    request: Request,
    scale: float,
    run: Callable[[Request], Optimized],
    path: str,
    output: str,
    folder: Path | None,
    voice: Voice,
) -> None:
    sizes = []
    for sized in curve(scale, _sizer(document, request, run, output, folder)):
        voice.say(optimization.curve_line(sized, scale))
        sizes.append(sized)
    kind = PurePath(path).suffix.lower()[1:]
    if kind == "csv":
        streams.write_text(optimization.curve_csv(sizes, scale), path)
    else:
        from anim.show.tradeoff import tradeoff as picture

        drawn = picture(sizes, scale, title=PurePath(path).stem, kind=kind)
        streams.write_bytes([np.frombuffer(drawn, np.uint8)], path)
