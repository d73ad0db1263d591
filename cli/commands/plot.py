"""`gltf-anim plot`: curves of tracks, easings and tangent rules."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from enum import StrEnum
from pathlib import PurePath
from typing import Annotated

import numpy as np
import typer

from anim.arrays import Floats, as_floats, as_key_times
from anim.curves.easing.table import parse
from anim.errors import DataRangeError, NotFoundError
from anim.maths.euler import check_order
from anim.operations.selection import Selection
from anim.show.plots.easing_plot import easing_plot
from anim.show.plots.rotations import COMPONENTS, FROM_REST
from anim.show.plots.stability_plot import stability_plot
from anim.show.plots.tangent_plot import tangent_plot
from anim.show.plots.track_plot import LIMIT, Names, track_plot
from anim.show.plots.track_selection import TrackSelection, compare_selection, select_tracks
from anim.simulation.comparison import Comparison, compare_integrators
from anim.simulation.integrators import oscillator
from anim.units import plural
from cli.errors import UsageError
from cli.io import documents
from cli.io.terminal import choose_protocol, print_picture
from cli.options import common
from cli.options import terminal as pictures
from cli.options.simulation import parse_seconds
from cli.text import Reporter, format_bytes

NUM_PERIODS = 10  # of the oscillator
MAX_STEPS = 10_000  # of it, a thousand a period: more are not seen, and take seconds
MAX_OMEGA_H = 1e6  # at which all but one method diverge in the first step
MAX_THROUGH, MIN_GAP_S, MAX_KEYS = 1e12, 1e-6, 1000  # of values and times of --through; between times; of both
LINE_WIDTH_PX = 2  # of curves in a PNG


class Format(StrEnum):
    """Image format."""

    PNG = "png"
    SVG = "svg"


def command(
    files: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[IN] [OUT]",
            help="A .glb or .gltf file and a .png or .svg file, '-' for pipes. With --ease or --through only OUT.",
            show_default=False,
        ),
    ] = None,
    *,
    compare: Annotated[
        str | None,
        typer.Option("--compare", metavar="FILE", help="Draw the same tracks of a second file over the first."),
    ] = None,
    ease: Annotated[
        list[str] | None,
        typer.Option(
            "--ease", metavar="NAME", help="Draw this easing instead of tracks, see ease --list; may be repeated."
        ),
    ] = None,
    through: Annotated[
        str | None,
        typer.Option(
            "--through",
            metavar="LIST",
            help="Draw curves through values, like 0,0.9,0.2,1, or through time:value pairs.",
        ),
    ] = None,
    tangents: Annotated[
        list[str] | None,
        typer.Option(
            "--tangents", metavar="NAME", help="Tangent rule for --through, or linear or step; may be repeated."
        ),
    ] = None,
    integrators: Annotated[
        bool, typer.Option("--integrators", help="Draw an oscillator by every time integrator, instead of tracks.")
    ] = False,
    omega: Annotated[
        float | None,
        typer.Option("--omega", metavar="N", help="Angular frequency in rad/s, for --integrators.", show_default="20"),
    ] = None,
    step: Annotated[
        str | None,
        typer.Option("--step", metavar="S", help="Time step in seconds, for --integrators.", show_default="1/60"),
    ] = None,
    format: Annotated[
        Format | None,
        typer.Option("--format", help="Output format (default: from OUT's extension, else png).", show_default=False),
    ] = None,
    euler: Annotated[
        str | None,
        typer.Option(
            "--euler",
            metavar="ORDER",
            help="Rotations as Euler angles of this order (intrinsic: XYZ, ZXY, …), with the distance to gimbal lock.",
        ),
    ] = None,
    components: Annotated[
        bool, typer.Option("--components", help="Rotations as quaternion components x, y, z, w, with tangent handles.")
    ] = False,
    limit: Annotated[int, typer.Option("--limit", metavar="N", help="Maximum number of tracks.")] = LIMIT,
    clip: common.Clips = None,
    node: common.Nodes = None,
    path: common.Paths = None,
    terminal: pictures.Terminal = False,
    protocol: pictures.PictureProtocol = None,
    quiet: common.Quiet = False,
) -> None:
    """Plot the curves of tracks, of easings, or of tangent rules.

    Tracks: their values with keys and tangent handles, and their speed below. Rotations are in degrees about the
    joint's own axes, relative to the rest pose, with the total angle. --euler ZXY shows Euler angles of that order, as
    in an animation tool, and the distance to gimbal lock: near 0, the first and third angle change fast. Constant
    tracks are left out if others move. --compare draws a second file over the first, matched by clip, node and path,
    and the difference.

    --ease draws easings side by side: f(t), its slope f′(t), and dots at equal time steps. --through draws curves
    through values, one second apart unless given as time:value, with their overshoot and continuity. --integrators
    draws one oscillator by every time integrator: its energy over ten periods, the amplitude gained per step against
    ω·h, and the motion in phase space. The same input and options give the same bytes. Requires matplotlib: pip install
    'gltf-anim[plot]'.

    Without OUT the picture is printed in a terminal that shows pictures: kitty, Ghostty and Konsole (protocol kitty);
    iTerm2, WezTerm, mintty and rio (iterm2); foot, mlterm and contour (sixel). In others, and inside tmux, screen and
    Zellij, --terminal prints it in half-block characters, as wide as the terminal. --protocol names one that the
    environment does not tell, such as sixel of xterm and Windows Terminal.
    """
    reporter = Reporter(quiet)
    if ease and through is not None:
        raise UsageError("--ease and --through exclude each other")
    if tangents and through is None:
        raise UsageError("--tangents needs --through (expected values for the curve to go through)")
    if integrators and (ease or through is not None):
        raise UsageError("--integrators excludes --ease and --through")
    if not integrators and (omega is not None or step is not None):
        raise UsageError("--omega and --step need --integrators")
    alone = bool(ease) or through is not None or integrators
    if alone and (compare is not None or clip or node or path or euler or components):
        raise UsageError(
            "--clip, --node, --path, --compare, --euler and --components need tracks, "
            "but --ease, --through and --integrators read no file"
        )
    if euler is not None and components:
        raise UsageError("--euler and --components exclude each other")
    view = COMPONENTS if components else FROM_REST if euler is None else check_order(euler)
    source, output = _places(files or [], alone=alone)
    shown = choose_protocol(asked=terminal, protocol=protocol, output=output)
    if shown is not None and format is Format.SVG:
        raise UsageError("--terminal shows no SVG", help="leave out --format, or name OUT")
    kind = _format(format, output)
    if shown is None:
        documents.check_binary(output)
    if ease:
        picture = easing_plot([parse(name) for name in ease], kind=kind)
    elif integrators:
        picture = _oscillator(20.0 if omega is None else omega, step or "1/60", kind)
    elif through is not None:
        times, values = _keys(through)
        picture = tangent_plot(times, values, tangents or ["catmull-rom"], kind=kind)
    else:
        picture = _tracks(source, Selection(clip or (), node or (), path or ()), view, compare, kind, limit, reporter)
    if shown is not None:
        print_picture(picture, shown, line_width=LINE_WIDTH_PX)
        return
    documents.write_bytes([np.frombuffer(picture, np.uint8)], output)
    if output != documents.PIPE:
        reporter.info(f"{output}  {format_bytes(len(picture))}")


def _oscillator(omega: float, step: str, kind: str) -> bytes:
    """Picture of an undamped oscillator, ten periods long, by all integrators."""
    seconds = parse_seconds(step, "--step")
    system = oscillator(omega)
    if omega * seconds > MAX_OMEGA_H:
        most = f"{_round(MAX_OMEGA_H / omega, ROUND_FLOOR)} s: --omega times --step is at most {MAX_OMEGA_H:g}"
        raise UsageError(f"--step is '{step}' (expected at most {most})")
    x = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    duration = max(NUM_PERIODS * 2 * np.pi / omega, 2 * seconds)
    if duration / seconds > MAX_STEPS:
        least = f"{_round(duration / MAX_STEPS, ROUND_CEILING)} s: {MAX_STEPS} steps in {NUM_PERIODS} periods"
        raise UsageError(f"--step is '{step}' (expected at least {least})")
    runs = compare_integrators(system, x, np.zeros_like(x), step=seconds, duration=duration)
    return stability_plot(Comparison(runs, omega * seconds, seconds, np.array([[0, 1]])), kind=kind)


def _round(seconds: float, rounding: str) -> str:
    """A limit with three digits, itself within the limit."""
    return f"{float(Context(prec=3, rounding=rounding).create_decimal_from_float(seconds)):.3g}"


def _places(files: list[str], *, alone: bool) -> tuple[str, str]:
    """Input and output paths; a single file is the input, or the output of a plot without input."""
    most = 1 if alone else 2
    if len(files) > most:
        raise UsageError(f"{len(files)} files are named (expected {'OUT' if alone else 'IN and OUT'})")
    if alone:
        return "", files[0] if files else documents.PIPE
    return (files[0] if files else documents.PIPE), (files[1] if len(files) > 1 else documents.PIPE)


def _format(chosen: Format | None, output: str) -> str:
    ending = PurePath(output).suffix.lower().lstrip(".")
    if chosen is not None:
        return chosen.value
    if output == documents.PIPE:
        return Format.PNG.value
    if ending not in list(Format):
        raise UsageError(f"{output}: is no .png or .svg file", help="name OUT so, or say --format png or svg")
    return ending


def _keys(text: str) -> tuple[Floats, Floats]:
    """Times and values parsed from "0,0.9,0.2,1" or "0:0,0.5:0.9,2:1"."""
    pairs = [part.rpartition(":") for part in text.split(",")]
    timed = {bool(colon) for _, colon, _ in pairs}
    try:
        values = np.array([float(value) for _, _, value in pairs])
        times = np.array([float(time) if colon else float(i) for i, (time, colon, _) in enumerate(pairs)])
    except ValueError:
        raise UsageError(f"--through can't read '{text}' (expected 0,0.9,0.2,1 or time:value,…)") from None
    if len(timed) > 1 or len(values) < 2:
        raise UsageError(f"--through has '{text}' (expected two or more values, all of them with a time or none)")
    if len(values) > MAX_KEYS:
        raise UsageError(f"--through has {len(values)} values (limit {MAX_KEYS})")
    try:
        found = as_key_times(times), as_floats(values, "K", name="values")
    except DataRangeError as error:
        raise UsageError(f"--through has '{text}': {error}") from None
    for name, numbers in (("value", values), ("time", times)):
        if np.abs(numbers).max() > MAX_THROUGH:
            raise UsageError(f"--through has a {name} of {np.abs(numbers).max():g} (limit {MAX_THROUGH:g})")
    if (gap := float(np.diff(times).min())) < MIN_GAP_S:
        raise UsageError(f"--through has times {gap:g} s apart (expected at least {MIN_GAP_S:g} s)")
    return found


def _tracks(
    source: str, selection: Selection, view: str, other: str | None, kind: str, limit: int, reporter: Reporter
) -> bytes:
    if limit < 1:
        raise UsageError(f"--limit is {limit} (expected 1 or more)")
    if source == other == documents.PIPE:
        raise UsageError("IN and --compare can't both be stdin")
    names = None
    with documents.source(source, reporter) as opened:
        name = opened.name
        try:
            chosen = select_tracks(opened.document, selection, limit=limit, view=view)
        except NotFoundError as error:
            raise error.advise("gltf-anim inspect IN --tracks lists them") from None
    if other is not None:
        with documents.source(other, reporter) as opened:
            chosen, alone = compare_selection(chosen, opened.document)
        names = Names(PurePath(name).name, PurePath(opened.name).name)
        if alone:
            reporter.info(
                f"note: {plural(alone, 'track')} of {name} {'is' if alone == 1 else 'are'} not in {opened.name}"
            )
    _report_left_out(chosen, reporter)
    title = PurePath(name).stem
    clips = {each.clip for each in chosen.shown}
    title = f"{title}: {clips.pop()}" if len(clips) == 1 else title
    return track_plot(chosen.shown, title=title, kind=kind, names=names, note=_count(chosen))


def _count(chosen: TrackSelection) -> str:
    return f"{len(chosen.shown)} of {plural(len(chosen.shown) + chosen.more, 'track')}" if chosen.more else ""


def _report_left_out(chosen: TrackSelection, reporter: Reporter) -> None:
    if chosen.more:
        reporter.info(
            f"note: drew the first {len(chosen.shown)} of {len(chosen.shown) + chosen.more} tracks that move; choose "
            "with --clip, --node and --path, or raise --limit"
        )
