"""`gltf-anim ease`: easing between the same keys, or over a time range."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from enum import StrEnum
from functools import partial
from typing import Annotated

import numpy as np
import typer

from anim.curves.easing.function import Easing
from anim.curves.easing.table import EASING_FACTORIES, EASINGS, parse, sparkline
from anim.gltf.reading import reader
from anim.model import Clip, Track
from anim.operations import ease as by_segment
from anim.operations import time_warp as by_range
from anim.operations.selection import Selection
from cli import errors, units
from cli.errors import UsageError
from cli.io import documents
from cli.options import common
from cli.reports.fit_notes import describe_easing
from cli.text import Reporter
from cli.workflows import many_files
from cli.workflows.edit_clips import Clips, edit_clips


class Per(StrEnum):
    """Time range of one easing."""

    SEGMENT = "segment"
    RANGE = "range"


Interpolation = StrEnum("Interpolation", [(name, name) for name in by_segment.OUTPUTS])  # type: ignore[misc]
CUBIC = Interpolation("cubicspline")


def command(
    input: common.Input = "-",
    output: common.Output = "-",
    more: common.More = None,
    *,
    out: common.Out = None,
    ease: Annotated[
        str,
        typer.Option(
            "--ease", metavar="NAME", help="Easing: smoothstep, quad-in-out, 'cubic-bezier(.2,0,0,1)', …; see --list."
        ),
    ] = "smoothstep",
    list_eases: Annotated[bool, typer.Option("--list", help="List all easings with their shapes.")] = False,
    per: Annotated[Per, typer.Option("--per", help="Ease every key interval, or the whole range once.")] = Per.SEGMENT,
    start: common.From = None,
    end: common.To = None,
    tolerance: Annotated[
        str,
        typer.Option(
            "--tolerance",
            metavar="FRACTION",
            help="Maximum error of easings that are not cubic, as a fraction of each key interval's range.",
        ),
    ] = "0.1%",
    angle_tolerance: Annotated[
        str, typer.Option("--angle-tolerance", metavar="ANGLE", help="The same for rotations: 0.05deg, 0.001rad.")
    ] = "0.05deg",
    interpolation: Annotated[
        Interpolation,
        typer.Option(
            "--interpolation", help="Interpolation of new keys: cubicspline needs fewer, linear plays everywhere."
        ),
    ] = CUBIC,
    clip: common.Clips = None,
    node: common.Nodes = None,
    path: common.Paths = None,
    dry_run: common.DryRun = False,
    quiet: common.Quiet = False,
    verbose: common.Verbose = False,
) -> int:
    """Change the speed of motion between keys by an easing.

    --per segment eases every key interval: the values of the keys and the path between them stay, only the speed along
    the path changes. --per range eases the whole range from --from to --to once, through all its keys.

    Cubic easings (smoothstep, quad, cubic, back, bounce, hermite) are written exactly as CUBICSPLINE, others with as
    few keys as --tolerance allows, and rotations always within --angle-tolerance: the last line states both where they
    apply. steps() becomes STEP. STEP tracks keep their values; only --per range moves their
    keys in time. Easings that overshoot exceed the values of the keys; the effect on scale and weights is reported.

    Easings are those of easings.net, but expo and elastic are scaled to be exactly 0 at the start and 1 at the end. The
    forms of easings.net, and of Penner, jump there: the difference is up to 0.001 of the key interval's change.
    """
    if list_eases:
        documents.write_text(_table())
        return errors.DONE
    easing = parse(ease)
    share, angle = (
        units.parse_fraction(tolerance, "--tolerance"),
        units.parse_angle(angle_tolerance, "--angle-tolerance"),
    )
    if per is Per.RANGE and easing.stepped:
        raise UsageError(
            f"'{easing.name}' is discontinuous; a time warp must be continuous", help="--per segment writes STEP keys"
        )
    tolerances = by_segment.Tolerances(share, angle)

    def change(each: Clip, tracks: frozenset[int], _: object) -> Clip:
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
        return eased

    selection, reporter = Selection(clip or (), node or (), path or ()), Reporter(quiet, verbose)

    def edit(input: str, output: str) -> None:
        edit_clips(
            input,
            output,
            selection,
            change,
            reporter,
            dry_run=dry_run,
            measure=False,
            notes=lambda before, after: _notes(before, after, easing, per),
            state=partial(
                describe_easing,
                is_cubic=easing.exact is not None,
                tolerance=share,
                angle_tolerance=angle,
                range_of="track" if per is Per.RANGE else "key interval",
            ),
        )

    return many_files.edit_named(input, output, more or (), out, edit, reporter, dry_run=dry_run)


MAX_SAMPLE_SPACING_S = 0.1  # s; keys nearer than this are samples of a motion rather than poses


def _notes(before: Clips, after: Clips, easing: Easing, per: Per) -> Iterator[str]:
    """Yield notes on the eased clips, each once for all clips that it applies to."""
    changed = {
        i: [old for old, new in zip(clip.tracks, after[i].tracks, strict=True) if old is not new]
        for i, clip in before.items()
    }
    steps = {i: found for i, tracks in changed.items() if (found := _usual_step(tracks)) is not None}
    dense = {i: step for i, step in steps.items() if step < MAX_SAMPLE_SPACING_S}
    if per is Per.SEGMENT and dense:
        yield (
            f"{_labels(before, dense)}: median key interval {1000 * min(dense.values()):.0f} ms; easing every "
            "interval makes the motion stutter (ease the whole clip once with --per range)"
        )
    if easing.overshoots:
        beyond = {i: {t.path for t in tracks} & {"scale", "weights"} for i, tracks in changed.items()}
        beyond = {i: paths for i, paths in beyond.items() if paths}
        if beyond:
            low, high = easing.extent
            yield (
                f"{_labels(before, beyond)}: '{easing.name}' reaches {100 * low:.0f} … {100 * high:.0f} % of each "
                f"key interval: {' and '.join(sorted(set.union(*beyond.values())))} values exceed their keys' range"
            )


def _usual_step(tracks: Iterable[Track]) -> float | None:
    """Median interval (s) between keys of different value; None without any."""
    steps = [np.diff(t.times)[(np.diff(t.values, axis=0) != 0).any(axis=1)] for t in tracks]
    every = np.concatenate([np.zeros(0), *steps])
    return float(np.median(every)) if len(every) else None


def _labels(clips: Clips, numbers: Iterable[int]) -> str:
    return reader.clip_labels([(clips[i].name, i) for i in numbers])


def _table() -> str:
    """Table of all easings with a sparkline; then the easing functions with arguments."""
    width = max(len(name) for name in EASINGS)
    lines = [f"{name:{width}}  {sparkline(each)}{_mark(each)}" for name, each in EASINGS.items()]
    makers = [f"{maker.usage}" for maker in EASING_FACTORIES.values()]
    exact = "exact: written as CUBICSPLINE without any error; others within --tolerance"
    scaled = "expo, elastic: scaled to be 0 at the start and 1 at the end; easings.net's differ by up to 0.001"
    return "\n".join([*lines, "", "with arguments:", *(f"  {each}" for each in makers), "", exact, scaled]) + "\n"


def _mark(easing: Easing) -> str:
    marks = ["exact"] if easing.exact is not None else []
    marks += ["overshoots"] if easing.overshoots else []
    return f"  {', '.join(marks)}" if marks else ""
