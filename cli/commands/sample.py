"""`gltf-anim sample`: the pose of every node at chosen times."""

from __future__ import annotations

import io
from enum import StrEnum
from pathlib import PurePath
from typing import Annotated, Any, NoReturn

import numpy as np
import typer

from anim.arrays import Floats
from anim.errors import NotFoundError
from anim.gltf.reading import reader
from anim.memory import MemoryBudget
from anim.model import Clip, Skeleton
from anim.operations.selection import Selection
from anim.sampling.sample import SPACES, PoseTable, sample
from anim.sampling.times import frame_times
from cli import tables
from cli.errors import UsageError
from cli.io import documents
from cli.options import common
from cli.reports import json_report
from cli.text import Reporter

SCHEMA = 1
BYTES_PER_POSE = 8 * 32  # of a node: translation, rotation, scale and matrix
BYTES_PER_NUMBER = 2  # of text to one as float64: roughly, for the numbers that are written


class Format(StrEnum):
    """Output format."""

    JSON = "json"
    CSV = "csv"
    NPZ = "npz"


Space = StrEnum("Space", [(name, name) for name in SPACES])  # type: ignore[misc]
LOCAL = Space("local")

Product = Annotated[
    str, typer.Argument(metavar="OUT", help="A .json, .csv or .npz file, '-' for stdout.", show_default=False)
]


def command(
    input: common.Input = "-",
    output: Product = "-",
    *,
    at: Annotated[
        list[float] | None, typer.Option("--at", metavar="S", help="Time in seconds; may be repeated.")
    ] = None,
    fps: Annotated[
        float | None, typer.Option("--fps", metavar="N", help="Frames per second, from the clip's start to its end.")
    ] = None,
    space: Annotated[
        Space, typer.Option("--space", help="local: relative to the parent; world: relative to the scene.")
    ] = LOCAL,
    format: Annotated[
        Format | None,
        typer.Option(
            "--format", help="Output format (default: from OUT's extension, json for '-').", show_default=False
        ),
    ] = None,
    clip: common.Clips = None,
    node: common.Nodes = None,
    quiet: common.Quiet = False,
) -> None:
    """Sample the pose of every node at chosen times, for scripts and plots.

    Without --at and --fps the times are those of the clip's own keys. Before the first key and after the last key the
    pose is constant. Rotations are unit quaternions x, y, z, w. JSON and NPZ also contain morph weights and
    KHR_animation_pointer values; NPZ contains one clip, and with --space world the matrices too.
    """
    if at and fps is not None:
        raise UsageError("--at and --fps exclude each other")
    if fps is not None and fps <= 0:
        raise UsageError(f"--fps is {fps:g} (expected a number above 0)")
    chosen_format = format or _format_of(output)
    if output != documents.PIPE:
        documents.check_file(output)
    with documents.source(input, Reporter(quiet)) as source:
        document = source.document
        selection = Selection(clip or (), node or ())
        clips, skeleton = reader.clips(document), reader.skeleton(document)
        numbers = selection.chosen_clips(reader.names(document))
        nodes = selection.chosen_nodes(skeleton)
        if chosen_format is Format.NPZ and len(numbers) != 1:
            _refuse_clips(len(numbers))
        times = {i: _times(clips[i], at, fps) for i in numbers}
        per_number = 1 if chosen_format is Format.NPZ else BYTES_PER_NUMBER
        budget = MemoryBudget(source.size)
        budget.add(per_number * BYTES_PER_POSE * len(skeleton) * sum(map(len, times.values())))
        taken = [(i, clips[i], sample(skeleton, clips[i], times[i], space=space.value)) for i in numbers]
    if chosen_format is Format.NPZ:
        documents.write_bytes([_npz(taken, skeleton, nodes)], output)
    else:
        write = _json if chosen_format is Format.JSON else _csv
        documents.write_text(write(taken, skeleton, nodes, space), output)


Taken = list[tuple[int, Clip, PoseTable]]


def _format_of(output: str) -> Format:
    ending = PurePath(output).suffix.lower().lstrip(".")
    if not ending:  # stdout, a named pipe
        return Format.JSON
    if ending not in list(Format):
        raise UsageError(f"{output}: no format is called .{ending} (expected .json, .csv or .npz)", help="or --format")
    return Format(ending)


def _times(clip: Clip, at: list[float] | None, fps: float | None) -> Floats:
    if at:
        return np.array(at, np.float64)
    if fps is not None:
        return frame_times(clip.start, clip.end, fps=fps)
    return clip.key_times


def _json(taken: Taken, skeleton: Skeleton, nodes: list[int], space: Space) -> str:
    clips = []
    for number, clip, poses in taken:
        listed = [_node(i, skeleton, poses) for i in nodes]
        about: dict[str, Any] = {"clip": clip.name, "index": number, "times_s": poses.times.tolist(), "nodes": listed}
        if poses.pointers:
            about["pointers"] = {pointer: values.tolist() for pointer, values in poses.pointers.items()}
        clips.append(about)
    return json_report.dump({"schema": SCHEMA, "space": str(space), "clips": clips}, indent=None)


def _node(i: int, skeleton: Skeleton, poses: PoseTable) -> dict[str, Any]:
    about: dict[str, Any] = {
        "index": i,
        "name": skeleton.names[i],
        "translation_m": poses.translation[:, i].tolist(),
        "rotation_xyzw": poses.rotation[:, i].tolist(),
        "scale": poses.scale[:, i].tolist(),
    }
    if i in poses.weights:
        about["weights"] = poses.weights[i].tolist()
    return about


def _csv(taken: Taken, skeleton: Skeleton, nodes: list[int], _: Space) -> str:
    header = ["clip", "time_s", "node", "name", "tx_m", "ty_m", "tz_m", "qx", "qy", "qz", "qw", "sx", "sy", "sz"]
    rows: list[list[tables.Cell]] = []
    for number, clip, poses in taken:
        joined = np.concatenate((poses.translation, poses.rotation, poses.scale), axis=2)
        for f, time in enumerate(_short(poses.times)):
            rows += [
                [reader.clip_name(clip.name, number), time, i, skeleton.names[i], *_short(joined[f, i])] for i in nodes
            ]
    return tables.comma_separated(header, rows)


def _short(values: Floats) -> list[float]:
    """Values rounded to nine significant digits, the precision of float32."""
    return [float(f"{value:.9g}") + 0.0 for value in values.tolist()]


def _refuse_clips(count: int) -> NoReturn:
    if not count:
        raise NotFoundError("there is no clip")
    raise UsageError(f"NPZ holds one clip, but {count} are chosen", help="choose one with --clip")


def _npz(taken: Taken, skeleton: Skeleton, nodes: list[int]) -> np.ndarray[Any, np.dtype[np.uint8]]:
    _, clip, poses = taken[0]
    arrays: dict[str, Any] = {
        "clip": np.array(clip.name),
        "times_s": poses.times,
        "names": np.array([skeleton.names[i] for i in nodes]),
        "nodes": np.array(nodes),
        "parents": skeleton.parents,
        "translation_m": poses.translation[:, nodes],
        "rotation_xyzw": poses.rotation[:, nodes],
        "scale": poses.scale[:, nodes],
    }
    if poses.world is not None:
        arrays["world_from_node"] = _four_rows(poses.world[:, nodes])
    arrays |= {f"weights_{i}": values for i, values in poses.weights.items() if i in nodes}
    arrays |= {f"pointer{pointer.replace('/', '.')}": values for pointer, values in poses.pointers.items()}
    out = io.BytesIO()
    np.savez(out, **arrays)
    return np.frombuffer(out.getvalue(), np.uint8)


def _four_rows(matrices: Floats) -> Floats:
    last = np.broadcast_to(np.array([0.0, 0.0, 0.0, 1.0]), (*matrices.shape[:-2], 1, 4))
    return np.concatenate((matrices, last), axis=-2)
