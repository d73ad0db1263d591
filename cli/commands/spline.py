"""`gltf-anim spline`: smooth curves through keys by a tangent rule."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Annotated

import typer

from anim.curves.tangents.table import DEFAULT_RULE, TANGENT_FACTORIES, TANGENTS, parse
from anim.gltf.reading import reader
from anim.measure.equal_clips import first_equal
from anim.measure.inspect.root_motion import root_motion_node
from anim.measure.loops.recommendations import closing_command
from anim.model import Clip, Scene
from anim.operations.loop import open_tracks
from anim.operations.selection import Selection
from anim.operations.spline import max_key_change
from anim.operations.spline import spline as splined
from anim.units import format_number
from cli import errors
from cli.io import documents
from cli.options import common
from cli.text import Reporter
from cli.workflows import many_files
from cli.workflows.edit_clips import Clips, edit_clips


def command(
    input: common.Input = "-",
    output: common.Output = "-",
    more: common.More = None,
    *,
    out: common.Out = None,
    tangents: Annotated[
        str, typer.Option("--tangents", metavar="NAME", help="Tangent rule; see --list.")
    ] = DEFAULT_RULE,
    list_rules: Annotated[bool, typer.Option("--list", help="List all tangent rules.")] = False,
    cyclic: Annotated[
        bool,
        typer.Option(
            "--cyclic",
            help="Continue the velocity across the loop; tracks must end as they start, except the root's path.",
        ),
    ] = False,
    clip: common.Clips = None,
    node: common.Nodes = None,
    path: common.Paths = None,
    dry_run: common.DryRun = False,
    quiet: common.Quiet = False,
    verbose: common.Verbose = False,
) -> int:
    """Put smooth curves through keys: CUBICSPLINE with tangents by a rule.

    The rule time-aware suits most motion. monotone never overshoots: for weights, or feet on the floor. natural and
    bspline have continuous acceleration; bspline does not pass through the keys, and its distance from them is
    reported. Tangents of rotations follow from angular velocity.

    Existing tangents are replaced; STEP tracks stay unchanged. The last line reports the largest change of the motion.
    """
    if list_rules:
        documents.write_text(_table())
        return errors.DONE
    rule = parse(tangents)

    def change(each: Clip, tracks: frozenset[int], scene: Callable[[], Scene]) -> Clip:
        def label(node: int) -> str:
            return scene().skeleton.label(node)

        root = root_motion_node(scene().skeleton, each) if cyclic or rule.loop else -1
        return splined(each, tangents=rule, cyclic=cyclic, root=root, tracks=tracks, label=label)

    def advise(each: Clip, number: int) -> str:
        is_open = (cyclic or rule.loop) and open_tracks(each)
        return f"close it first: {closing_command(each, number)}" if is_open else ""

    selection, reporter = Selection(clip or (), node or (), path or ()), Reporter(quiet, verbose)

    def edit(input: str, output: str) -> None:
        edit_clips(input, output, selection, change, reporter, dry_run=dry_run, notes=_notes, advise=advise)

    return many_files.edit_named(input, output, more or (), out, edit, reporter, dry_run=dry_run)


def _notes(before: Clips, after: Clips) -> Iterator[str]:
    """Yield notes on the largest distance of the curve from its keys."""
    pairs = [(old, after[i]) for i, old in before.items()]
    first = first_equal(pairs)
    changes = {n: max_key_change(*pairs[n]) for n in set(first)}
    found = {i: changes[n] for i, n in zip(before, first, strict=True)}
    found = {i: each for i, each in found.items() if each[0] or each[1] > MIN_DEVIATION_RAD}
    if found:
        moved, turned = (max(each[k] for each in found.values()) for k in range(2))
        far = [f"rotations by up to {format_number(math.degrees(turned), 2)}°"] if turned > MIN_DEVIATION_RAD else []
        far += [f"other values by up to {moved:.3g}"] if moved else []
        where = reader.clip_labels([(before[i].name, i) for i in found])
        yield f"{where}: the curve does not pass through its keys ({', '.join(far)}); --tangents natural does"


MIN_DEVIATION_RAD = 1e-6  # rad; smaller angles come from rounding


_ABOUT = {
    "time-aware": "parabola through three keys, with any spacing; the default",
    "catmull-rom": "slope from the previous to the next key",
    "centripetal": "no cusps or loops in the path; in time the speed may jump",
    "monotone": "stays between the values of two keys",
    "akima": "weights the steadier side more: one outlier has little effect",
    "flat": "stops at every key",
    "natural": "continuous acceleration through all keys",
    "clamped": "the same, with velocity 0 at both ends",
    "periodic": "the same for a loop",
    "bspline": "continuous acceleration, smoothest; does not pass through the keys",
}


def _table() -> str:
    width = max(len(name) for name in TANGENTS)
    lines = [f"{name:{width}}  {_ABOUT.get(name, '')}".rstrip() for name in TANGENTS]
    makers = [f"  {maker.usage}" for maker in TANGENT_FACTORIES.values()]
    return "\n".join([*lines, "", "with arguments:", *makers]) + "\n"
