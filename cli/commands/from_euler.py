"""`gltf-anim from-euler`: BVH, CSV and JSON curves become glTF."""

from __future__ import annotations

import time
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from anim.errors import FormatError
from anim.exchange.euler.baked_keys import KeyPlacement
from anim.exchange.euler.convention import PartialConvention
from anim.exchange.euler.evaluate import bounding_size, skeleton
from anim.exchange.euler.from_euler import from_euler
from anim.exchange.euler.gimbal import gimbal_stats
from anim.exchange.euler.motion import EulerMotion, Unit, scale_motion, z_up_to_y_up
from anim.exchange.euler.unit_guess import guess_unit
from anim.exchange.formats import registry
from anim.exchange.formats.bvh_reader import BvhPosition
from anim.exchange.formats.registry import TRACK_FORMATS, TrackReadOptions
from anim.exchange.retarget.retarget import GroundMode
from anim.exchange.split_skins import split_by_root
from anim.exchange.stick_mesh import stick_mesh
from anim.gltf import authoring
from anim.gltf.document import Document
from anim.gltf.io.source import Source
from anim.maths.euler import AxesConvention, check_order
from cli import text, units
from cli.errors import UsageError
from cli.io import documents
from cli.options import common
from cli.options.common import Format
from cli.reports import from_euler_report, image_notes
from cli.reports.from_euler_report import ConversionReport
from cli.workflows.character import CharacterOptions, check_name, index_of, named, pairs, put_on_character

MAX_HEIGHT_M = 10.0  # m; a taller skeleton is unlikely to be in meters


class Up(StrEnum):
    """Up axis of the source."""

    Y = "y"
    Z = "z"


class Mesh(StrEnum):
    """Mesh of a new skeleton."""

    NONE = "none"
    STICKS = "sticks"


def command(
    source: Annotated[
        str, typer.Argument(metavar="SOURCE", help="A .bvh, .csv or .json file, '-' for stdin.", show_default=False)
    ] = "-",
    output: common.Output = "-",
    *,
    order: Annotated[
        str | None,
        typer.Option("--order", metavar="ORDER", help="Rotation order as written: XYZ … ZYX, XYX … ZYZ (CSV, JSON)."),
    ] = None,
    axes: Annotated[
        AxesConvention | None,
        typer.Option("--axes", help="Intrinsic (body) or extrinsic (fixed) axes; FBX and Maya: extrinsic."),
    ] = None,
    unit: Annotated[Unit | None, typer.Option("--unit", help="Unit of the angles (CSV, JSON).")] = None,
    keys: Annotated[
        KeyPlacement, typer.Option("--keys", help="Key placement; auto keeps the grid of recordings.")
    ] = KeyPlacement.AUTO,
    angle_tolerance: Annotated[
        str,
        typer.Option("--angle-tolerance", metavar="ANGLE", help="Maximum angle between slerp and the Euler motion."),
    ] = "0.05deg",
    scale: Annotated[
        float | None,
        typer.Option("--scale", metavar="N", help="Meters per unit; multiplies the file's own value. Guessed for BVH."),
    ] = None,
    up: Annotated[Up, typer.Option("--up", help="Up axis of the source.")] = Up.Y,
    bvh_position: Annotated[
        BvhPosition,
        typer.Option("--bvh-position", help="BVH positions replace the OFFSET of a joint, or are added to it."),
    ] = BvhPosition.REPLACE,
    mesh: Annotated[Mesh, typer.Option("--skeleton-mesh", help="Mesh of the new skeleton.")] = Mesh.NONE,
    onto: Annotated[
        str | None, typer.Option("--onto", metavar="FILE", help="Character to transfer the motion to, a glTF file.")
    ] = None,
    alias: Annotated[
        str | None,
        typer.Option("--alias", metavar="FILE", help="For --onto: pairs of joint names, CSV 'source,target' or JSON."),
    ] = None,
    fail_unmatched: Annotated[
        int | None,
        typer.Option(
            "--fail-unmatched", metavar="N", help="For --onto: exit 6 if more than N joints are unmatched.", min=0
        ),
    ] = None,
    floor: Annotated[
        GroundMode,
        typer.Option("--floor", help="For --onto: keep the contact of soles with the floor, or only scale heights."),
    ] = GroundMode.CONTACT,
    bind_time: Annotated[
        float | None,
        typer.Option("--bind-time", metavar="S", help="For --onto: time of the source's rest pose, in seconds."),
    ] = None,
    name: Annotated[str | None, typer.Option("--name", help="Name of the clip (default: from the source).")] = None,
    replace: Annotated[
        str | None,
        typer.Option("--replace", metavar="CLIP", help="For --onto: clip to replace, by name or '#3'."),
    ] = None,
    format: Annotated[
        Format, typer.Option("--format", help="Report format: text on stderr, or JSON on stdout.")
    ] = Format.TEXT,
    dry_run: common.DryRun = False,
    quiet: common.Quiet = False,
    verbose: common.Verbose = False,
) -> None:
    """Convert Euler tracks to glTF: BVH, or CSV or JSON curves.

    Each axis is evaluated on its own keys, the angles are combined by --order and --axes, and keys are placed so that
    slerp follows the motion between them. A BVH specifies its own order and keeps its frames.

    Without --onto, a new skeleton is made. With --onto, joints are matched by name, and the motion is transferred to
    the character; differences of rest pose and size are taken into account. -v lists the smallest distance of each
    joint to gimbal lock, and the matched joints, or all names if none match. The README describes the CSV and JSON
    formats.
    """
    began = time.perf_counter()
    reporter = text.Reporter(quiet, verbose)
    limit = units.parse_angle(angle_tolerance, "--angle-tolerance")
    _check(source, output, format, scale, onto, mesh, dry_run=dry_run)
    if onto is None and (alias, fail_unmatched, bind_time, replace, floor) != (*[None] * 4, GroundMode.CONTACT):
        words = "--alias, --fail-unmatched, --floor, --replace and --bind-time"
        raise UsageError(f"{words} require --onto (the character)")
    stated = PartialConvention(None if order is None else check_order(order), axes, unit)
    with documents.content(source, ending=TRACK_FORMATS["bvh"].suffix) as (data, called):
        kind = registry.of_path(source) or registry.of_content(data.tobytes())
        motion = kind.read(data.tobytes(), TrackReadOptions(stated, bvh_position))
        motion = z_up_to_y_up(motion) if up is Up.Z else motion
        meters, words, is_guess = _meters_per_unit(motion, scale, known=kind.has_units)
        clip = name or (Path(source).stem if source != documents.PIPE else "motion")
        converted = from_euler(scale_motion(motion, meters), tolerance=limit, keys=keys, name=clip)
        if not converted.clip.tracks:
            raise FormatError("no curve has a key: there is no motion in it")
    rows = () if quiet and format is Format.TEXT else gimbal_stats(motion, converted.clip)
    made = ConversionReport(kind.suffix[1:], motion, converted, meters, words, rows, is_guess=is_guess)
    if onto is None:
        bones = converted.skeleton
        bodies = split_by_root(bones, *stick_mesh(bones, converted.ends)) if mesh is Mesh.STICKS else []
        document = authoring.build_document(bones, [converted.clip], bodies)
        size = _write(made, document, output, None, format, reporter, dry_run=dry_run)
        written = text.format_bytes(size)
    else:
        names = pairs(alias)
        with documents.source(onto, reporter) as character:
            taken = index_of(replace, character.document)
            check_name(name, taken, character.document)
            made = named(made, character.document, name=name, replaced=taken)
            casting = CharacterOptions(names, floor, bind_time, fail_unmatched, taken)
            made, document = put_on_character(made, character, casting, reporter)
            size = _write(made, document, output, character, format, reporter, dry_run=dry_run)
            written = text.format_change(character.size, size)
        if not dry_run:
            image_notes.report(document, character, output, reporter)
    for line in from_euler_report.lines(made, verbose=verbose):
        reporter.info(line)
    parts = [
        f"{called if output == documents.PIPE else output}  {written}",
        from_euler_report.counts(made),
    ]
    ending = " (dry run: nothing written)" if dry_run else ""
    reporter.info(f"{', '.join(parts)}, {text.format_duration(time.perf_counter() - began)}{ending}")


def _write(
    made: ConversionReport,
    document: Document,
    output: str,
    source: Source | None,
    format: Format,
    reporter: text.Reporter,
    *,
    dry_run: bool,
) -> int:
    """Write the file, and the report if it is JSON, which is made before: without it nothing changes. Return the size.

    source: the document's input, if it is one's.
    """
    for each in from_euler_report.warnings(made):
        reporter.warn(each)
    found = from_euler_report.as_json(made, warnings=reporter.warnings) if format is Format.JSON else ""
    size = documents.write(document, output, source, dry_run=dry_run, reporter=reporter)
    if found:
        documents.write_text(found)
    return size


def _check(
    source: str, output: str, format: Format, scale: float | None, onto: str | None, mesh: Mesh, *, dry_run: bool
) -> None:
    """Raise UsageError for contradicting options, before any work."""
    common.check_scale(scale)
    if onto is not None and mesh is not Mesh.NONE:
        raise UsageError("--skeleton-mesh makes a body for a new skeleton (--onto has one)")
    if source == onto == documents.PIPE:
        raise UsageError("SOURCE and --onto can't both be stdin")
    if format is Format.JSON and output == documents.PIPE and not dry_run:
        raise UsageError("--format json and the GLB both want stdout", help="name an output file, or add --dry-run")
    documents.check_output(output, dry_run=dry_run)


def _meters_per_unit(motion: EulerMotion, scale: float | None, *, known: bool) -> tuple[float, str, bool]:
    """Meters per unit of the motion, the description of its origin, and whether it is a guess."""
    height = bounding_size(skeleton(motion))
    if scale is not None:
        return (
            scale,
            f"{scale:g} m per unit (--scale): skeleton height {text.format_length(height * scale)}",
            False,
        )
    if known and height < MAX_HEIGHT_M:
        return 1.0, "", False
    if known:
        return (
            1.0,
            f"skeleton height {text.format_length(height)} (--scale 0.01 if its unit is centimeters)",
            True,
        )
    guess = guess_unit(height)
    measures = f"skeleton height {text.format_length(guess.height)}"
    words = f"{guess.scale:.4g} m per unit, guessed: {guess.unit}, {measures} (change with --scale)"
    return guess.scale, words, True
