"""`gltf-anim to-euler`: Euler curves of a clip as BVH, CSV or JSON."""

from __future__ import annotations

import math
import time
from enum import StrEnum
from typing import Annotated

import typer

from anim.errors import NotFoundError
from anim.exchange.euler.motion import Convention, EulerMotion, Unit
from anim.exchange.euler.rotation_order import AUTO, DEFAULT_ORDER, OrderRules, parse
from anim.exchange.euler.to_bvh_motion import to_bvh
from anim.exchange.euler.to_euler import to_euler
from anim.exchange.formats.registry import TRACK_FORMATS, TrackFormat, of_path
from anim.exchange.retarget.bind_pose import bind_pose, fill_from_parents
from anim.gltf.document import Document, json_array
from anim.gltf.reading import reader
from anim.maths.euler import AxesConvention
from anim.model import Clip
from anim.operations.selection import Selection
from anim.units import format_number, plural
from cli import text, units
from cli.errors import UsageError
from cli.io import documents
from cli.options import common

Format = StrEnum("Format", {name.upper(): name for name in TRACK_FORMATS})  # type: ignore[misc]
MIN_DEVIATION_DEG = 1e-6  # degrees; smaller ones come from rounding
WARNED_DEVIATION_DEG = 1.0  # degrees; larger ones are warned of unless a tolerance was given
DEFAULT_METERS_PER_UNIT = 0.01  # default m per unit of a BVH


def command(
    input: common.Input = "-",
    output: Annotated[
        str, typer.Argument(metavar="OUT", help="A .bvh, .csv or .json file, '-' for stdout.", show_default=False)
    ] = "-",
    *,
    order: Annotated[
        str,
        typer.Option(
            "--order",
            metavar="ORDER",
            help="Rotation order as written: XYZ …; auto: for each joint the one farthest from gimbal lock; "
            "or 'hips=ZXY,*arm=YZX,auto'.",
        ),
    ] = DEFAULT_ORDER,
    axes: Annotated[
        AxesConvention,
        typer.Option("--axes", help="Intrinsic (body) or extrinsic (fixed) axes; FBX and Maya: extrinsic."),
    ] = AxesConvention.INTRINSIC,
    unit: Annotated[Unit, typer.Option("--unit", help="Unit of the angles; BVH has degrees.")] = Unit.DEG,
    fps: Annotated[
        float | None, typer.Option("--fps", metavar="N", help="Frames per second (default: the source's keys).")
    ] = None,
    angle_tolerance: Annotated[
        str | None,
        typer.Option(
            "--angle-tolerance",
            metavar="ANGLE",
            help="CSV, JSON: maximum error, like 0.1deg; keys are added where it is exceeded.",
        ),
    ] = None,
    scale: Annotated[
        float | None,
        typer.Option("--scale", metavar="N", help="BVH: meters per unit, 0.01 by default; the file can't store it."),
    ] = None,
    format: Annotated[
        Format | None,
        typer.Option(
            "--format", help="Output format (default: from OUT's extension, bvh for '-').", show_default=False
        ),
    ] = None,
    clip: common.Clips = None,
    dry_run: common.DryRun = False,
    quiet: common.Quiet = False,
) -> None:
    """Write a clip as continuous Euler curves: BVH, CSV or JSON.

    Each key gets the equivalent angles closest to those of the key before, also through gimbal lock. BVH contains the
    joints of the skins (or all nodes), with angles relative to the bind pose, on a regular grid of frames. CSV and JSON
    contain the local transform of every node, its rest pose and its parent; from-euler reads all three.
    """
    began = time.perf_counter()
    reporter = text.Reporter(quiet)
    kind = _kind(output, format)
    limit = None if angle_tolerance is None else units.parse_angle(angle_tolerance, "--angle-tolerance")
    orders = _orders(order, kind)
    _check(kind, unit, axes, scale, limit)
    if output != documents.PIPE:
        documents.check_file(output)
    convention = Convention(DEFAULT_ORDER if orders.otherwise == AUTO else orders.otherwise, axes, unit)
    with documents.source(input, reporter) as source:
        chosen = _only(reader.clips(source.document), clip)
        motion, words, num_bound, deviation = _motion(
            source.document, chosen, kind, orders, axes, fps, limit, scale or DEFAULT_METERS_PER_UNIT
        )
        data = kind.write(motion, convention)
        if kind is TRACK_FORMATS["bvh"]:  # which can't store its unit
            meters = f"{scale or DEFAULT_METERS_PER_UNIT:g}"
            words = f"1 unit = {meters} m (from-euler --scale {meters}), "
    if not dry_run:
        documents.write_text(data, output)
    if num_bound:
        verb = "rests" if num_bound == 1 else "rest"
        resting = f"{plural(num_bound, 'joint')} {verb} elsewhere in the file than the skin was bound"
        reporter.warn(f"{resting}: the bind pose is the rest of these curves")
    for note in motion.notes:
        reporter.warn(note)
    if limit is None and math.degrees(deviation) > WARNED_DEVIATION_DEG:
        error = f"{format_number(math.degrees(deviation), 2)}°"
        reporter.warn(f"between keys, the curves are off by up to {error}: --angle-tolerance 0.1deg adds keys")
    name = source.name if output == documents.PIPE else output
    ending = " (dry run: nothing written)" if dry_run else ""
    reporter.info(
        f"{name}  {text.format_bytes(len(data))}, {plural(len(motion.nodes), 'node')}, "
        f"{words}{text.format_duration(time.perf_counter() - began)}{ending}"
    )


def _kind(output: str, format: Format | None) -> TrackFormat:
    if format is not None:
        return TRACK_FORMATS[str(format)]
    found = of_path(output)
    if found is None and output != documents.PIPE:
        known = ", ".join(each.suffix for each in TRACK_FORMATS.values())
        raise UsageError(f"'{output}' names no format (expected {known}, or --format)")
    return found or TRACK_FORMATS["bvh"]


def _orders(text: str, kind: TrackFormat) -> OrderRules:
    orders = parse(text)
    if not orders.is_one and kind is TRACK_FORMATS["csv"]:
        raise UsageError("a CSV has one order for all nodes", help="write .json or .bvh")
    return orders


def _check(kind: TrackFormat, unit: Unit, frame: AxesConvention, scale: float | None, limit: float | None) -> None:
    common.check_scale(scale)
    if kind is not TRACK_FORMATS["bvh"]:
        if scale is not None:
            raise UsageError("--scale is the unit of a BVH (CSV and JSON are in meters)")
        return
    if unit is not Unit.DEG or frame is not AxesConvention.INTRINSIC:
        raise UsageError(
            "a BVH's angles are intrinsic, in degrees", help="an extrinsic order is an intrinsic one reversed"
        )
    if limit is not None:
        raise UsageError("--angle-tolerance adds keys, but a BVH's frames stand on a grid", help="give --fps")


def _only(clips: tuple[Clip, ...], globs: list[str] | None) -> Clip:
    chosen = Selection(globs or ()).chosen_clips([each.name for each in clips])
    if len(chosen) != 1:
        names = ", ".join(reader.quote_clip(clips[i].name, i) for i in chosen[:8])
        raise NotFoundError(
            f"{plural(len(chosen), 'clip')} to choose from (expected one)",
            help=f"--clip one of {names}" if chosen else "",
        )
    return clips[chosen[0]]


def _motion(
    document: Document,
    clip: Clip,
    kind: TrackFormat,
    orders: OrderRules,
    frame: AxesConvention,
    fps: float | None,
    limit: float | None,
    scale: float,
) -> tuple[EulerMotion, str, int, float]:
    """The motion to write, and facts about it.

    Notes on lost data, number of joints with another rest pose, largest error between keys in radians.
    """
    nodes = reader.skeleton(document)
    bound = bind_pose(nodes, reader.skins(document))
    skeleton = bound.skeleton
    clip = fill_from_parents(clip, nodes, skeleton)
    if kind is TRACK_FORMATS["bvh"]:
        joints = {joint for skin in json_array(document.json, "skins") for joint in skin["joints"]}
        made = to_bvh(skeleton, clip, order=orders, fps=fps, joints=joints, meters_per_unit=scale)
        return made, "", bound.num_joints, 0.0
    holders = {i for i, node in enumerate(json_array(document.json, "nodes")) if "skin" in node}
    found = to_euler(
        skeleton,
        clip,
        order=orders,
        frame=frame,
        fps=fps,
        tolerance=limit,
        without=holders,
    )
    words = (
        f"between keys off by up to {format_number(math.degrees(found.deviation), 2)}°, "
        if math.degrees(found.deviation) > MIN_DEVIATION_DEG
        else ""
    )
    return found.motion, words, bound.num_joints, found.deviation
