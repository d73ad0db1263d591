"""`gltf-anim ease`: another tempo between the same keys."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Annotated

import typer

from anim.curves.ease import Easing
from anim.curves.easing import EASING_MAKERS, EASINGS, parse, sparkline
from anim.model import Clip, Skeleton
from anim.ops import ease as by_segment
from anim.ops import warp as by_range
from anim.ops.selection import Selection
from cli import options, streams, units
from cli.edit import edit
from cli.errors import UsageError
from cli.report import Voice


class Per(StrEnum):
    """What one ease covers."""

    SEGMENT = "segment"
    RANGE = "range"


Interpolation = StrEnum("Interpolation", [(name, name) for name in by_segment.OUTPUTS])  # type: ignore[misc]
CUBIC = Interpolation("cubicspline")


def ease(
    input: options.Input = "-",
    output: options.Output = "-",
    *,
    ease: Annotated[
        str, typer.Option("--ease", metavar="NAME", help="smoothstep, quad-in-out, 'cubic-bezier(.2,0,0,1)', …")
    ] = "smoothstep",
    list_eases: Annotated[bool, typer.Option("--list", help="Show all eases with their shapes.")] = False,
    per: Annotated[
        Per, typer.Option("--per", help="Ease every piece from key to key, or the whole range once.")
    ] = Per.SEGMENT,
    start: options.From = None,
    end: options.To = None,
    tolerance: Annotated[
        str, typer.Option("--tolerance", metavar="SHARE", help="For eases that no cubic is: share of a piece's range.")
    ] = "0.1%",
    angle_tolerance: Annotated[
        str, typer.Option("--angle-tolerance", metavar="ANGLE", help="The same for rotations: 0.05deg, 0.001rad.")
    ] = "0.05deg",
    interpolation: Annotated[
        Interpolation, typer.Option("--interpolation", help="cubicspline needs few keys, linear plays everywhere.")
    ] = CUBIC,
    clip: options.Clips = None,
    node: options.Nodes = None,
    path: options.Paths = None,
    dry_run: options.DryRun = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
) -> None:
    """Give motion another tempo between the same keys.

    --per segment eases every piece from key to key: same values, same path, new tempo. --per range runs once through
    all keys from --from to --to with one ease. Cubic eases (smoothstep, quad, cubic, back, bounce, hermite) are written
    exactly as CUBICSPLINE, others with the fewest keys within --tolerance; steps become STEP. STEP tracks hold on
    purpose and stay. Overshooting eases go beyond the keys; what that does to scale and weights is reported.
    """
    if list_eases:
        streams.write_text(_table())
        return
    voice = Voice(quiet, verbose)
    easing = parse(ease)
    share, angle = units.share(tolerance, "--tolerance"), units.angle(angle_tolerance, "--angle-tolerance")
    if per is Per.RANGE and easing.stepped:
        raise UsageError(f"'{easing.name}' jumps, and time can't", help="--per segment makes STEP keys of it")
    tolerances = by_segment.Tolerances(share, angle)

    def change(each: Clip, tracks: frozenset[int], _: Skeleton) -> Clip:
        if per is Per.RANGE:
            eased = by_range.warp(
                each,
                easing=easing,
                start=start,
                end=end,
                tolerance=share,
                angle_tolerance=angle,
                interpolation=interpolation.value,
                tracks=tracks,
            )
        else:
            eased = by_segment.ease(
                each,
                easing=easing,
                start=-math.inf if start is None else start,
                end=math.inf if end is None else end,
                tolerances=tolerances,
                interpolation=interpolation.value,
                tracks=tracks,
            )
        _note(each, eased, easing, per, voice)
        return eased

    edit(input, output, Selection(clip or (), node or (), path or ()), change, voice, dry_run=dry_run, measure=False)


DENSE = 0.1  # s; keys nearer than this are samples of a motion rather than poses


def _note(before: Clip, after: Clip, easing: Easing, per: Per, voice: Voice) -> None:
    """Say what a user would want to know before playing it."""
    changed = [old for old, new in zip(before.tracks, after.tracks, strict=True) if old is not new]
    if per is Per.SEGMENT and changed:
        gaps = sorted((float(t.times[-1] - t.times[0]) / (len(t.times) - 1)) for t in changed if len(t.times) > 1)
        if gaps and gaps[len(gaps) // 2] < DENSE:
            voice.say(
                f"note: clip '{before.name}': keys are {1000 * gaps[len(gaps) // 2]:.0f} ms apart; easing each such "
                "piece makes the motion stutter (--per range eases the whole)"
            )
    if easing.overshoots:
        beyond = sorted({track.path for track in changed if track.path in ("scale", "weights")})
        if beyond:
            low, high = easing.extent
            voice.say(
                f"note: clip '{before.name}': '{easing.name}' runs to {100 * low:.0f} … {100 * high:.0f} % of each "
                f"piece, so values of {' and '.join(beyond)} leave the range of their keys"
            )


def _table() -> str:
    """All eases with a sparkline; then those that take arguments."""
    width = max(len(name) for name in EASINGS)
    lines = [f"{name:{width}}  {sparkline(each)}{_mark(each)}" for name, each in EASINGS.items()]
    makers = [f"{maker.usage}" for maker in EASING_MAKERS.values()]
    exact = "exact: written as CUBICSPLINE without any error; others within --tolerance"
    return "\n".join([*lines, "", "with arguments:", *(f"  {each}" for each in makers), "", exact]) + "\n"


def _mark(easing: Easing) -> str:
    marks = ["exact"] if easing.exact is not None else []
    marks += ["overshoots"] if easing.overshoots else []
    return f"  {', '.join(marks)}" if marks else ""
