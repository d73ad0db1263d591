"""`gltf-anim collapse`: where linear skinning pinches, and what other methods make of it."""

from __future__ import annotations

import json
import math
from pathlib import PurePath
from typing import Annotated, Any

import numpy as np
import typer

from anim.gltf import read
from anim.ops.selection import Selection
from anim.sampling.times import grid
from anim.show.collapse import collapse as picture_of
from anim.skinning.advice import Found, advice
from anim.skinning.collapse import LOW, Comparison, MeshCollapse
from anim.skinning.fared import BULGE, Fared
from cli import meshes, options, streams, tables
from cli.errors import UsageError
from cli.options import Format
from cli.progress import Progress
from cli.report import Voice, plural, size
from cli.skinning_methods import Method

SCHEMA = 1

USUAL = ("lbs", "dqs")


def collapse(
    input: options.Input = "-",
    *,
    method: Annotated[
        list[Method] | None, typer.Option("--method", help="A method to compare; may be repeated.  [default: lbs, dqs]")
    ] = None,
    fps: Annotated[float, typer.Option("--fps", metavar="N", help="Frames per second to look at.")] = 30,
    clip: options.Clips = None,
    mesh: meshes.Meshes = None,
    format: options.Report = Format.TEXT,
    plot: Annotated[
        str | None, typer.Option("--plot", metavar="OUT", help="Draw index and volume over time into a .png or .svg.")
    ] = None,
    quiet: options.Quiet = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Every mesh, not the worst of each clip.")] = False,
) -> None:
    """Say where skin collapses when joints twist and bend, and what other methods make of it.

    The collapse index is what linear blending leaves of the radius around a vertex: 1 is rigid, 0.71 a quarter turn
    between two joints, 0 a candy wrapper. It needs no closed mesh. Where parts of a mesh are closed, the volume that
    they enclose is compared method by method, against that in bind pose. Bulge is the greatest distance of a vertex
    from the links between its joints, against that in bind pose. Below: what to do.
    """
    if fps <= 0:
        raise UsageError(f"--fps is {fps:g} (expected a number above 0)")
    if plot is not None:
        streams.check_file(plot)
        if PurePath(plot).suffix.lower() not in (".png", ".svg"):
            raise UsageError(f"{plot}: is no .png or .svg file")
    methods = tuple(dict.fromkeys(str(each) for each in method)) if method else USUAL
    found: list[Found] = []
    with streams.source(input) as source:
        document = source.document
        clips, scene = read.clips(document), read.scene(document)
        numbers = Selection(clip or ()).chosen_clips(read.names(document))
        comparison = Comparison(scene, methods=methods, nodes=meshes.nodes(scene, mesh))
        progress = Progress("collapse", len(numbers), shown=not quiet)
        for done, i in enumerate(numbers):
            times = grid(clips[i].start, clips[i].end, fps=fps)
            found += [Found(clips[i].name or str(i), each) for each in comparison.of(clips[i], times=times)]
            progress(done + 1)
        progress.close()
    if plot is not None:
        kind = PurePath(plot).suffix.lower()[1:]
        picture = picture_of(_worst_of_clips(found), title=PurePath(source.name).stem, kind=kind)
        streams.write_bytes([np.frombuffer(picture, np.uint8)], plot)
        Voice(quiet).say(f"{plot}  {size(len(picture))}")
    if format is Format.JSON:
        streams.write_text(_json(source.name, methods, fps, found))
    else:
        streams.write_text(_page(source.name, methods, found, every=verbose))


def _worst_of_clips(found: list[Found]) -> list[Found]:
    """The worst mesh of each clip, in the order of the clips."""
    worst: dict[str, Found] = {}
    for each in found:
        if each.clip not in worst or each.mesh.worst.index < worst[each.clip].mesh.worst.index:
            worst[each.clip] = each
    return list(worst.values())


def _page(name: str, methods: tuple[str, ...], found: list[Found], *, every: bool) -> str:
    clips, count = len({each.clip for each in found}), len({each.mesh.node for each in found})
    shown = found if every else _worst_of_clips(found)
    header = ["clip", "mesh", "index", f"< {LOW}", "inverted", "at", "joints", "turn"]
    header += [f"volume {each}" for each in methods] + [f"bulge {each}" for each in methods]
    table = tables.text(header, [_row(each) for each in shown], left=2) if shown else ""
    lines = [f"  {line}" for line in advice(found)]
    about = f"{name}: {plural(clips, 'clip')}, {count} skinned {'mesh' if count == 1 else 'meshes'}"
    note = "" if every or count < 2 else "; the worst mesh of each clip (-v: all)"
    return f"{about}{note}\n\n{table}\n" + "\n".join(lines) + "\n"


def _row(found: Found) -> list[tables.Cell]:
    mesh = found.mesh
    worst = mesh.worst
    two = worst.angle > 0
    cells: list[tables.Cell] = [
        found.clip,
        mesh.mesh,
        f"{worst.index:.2f}",
        _percent(mesh.low),
        _percent(mesh.inverted),
        f"{worst.time:.2f} s" if two else None,
        f"{worst.joint} ~ {worst.other}" if two else None,
        f"{math.degrees(worst.angle):.0f}° {'twist' if worst.twist else 'bend'}" if two else None,
    ]
    cells += [None if each.volume is None else f"{100 * each.volume.min():.0f} %" for each in mesh.methods]
    return [*cells, *(f"{each.bulge:.2f}×" if each.bulge > 1 else None for each in mesh.methods)]


def _percent(share: float) -> str | None:
    return f"{100 * share:.2g} %" if share else None


def _json(name: str, methods: tuple[str, ...], fps: float, found: list[Found]) -> str:
    clips: dict[str, list[dict[str, Any]]] = {}
    for each in found:
        clips.setdefault(each.clip, []).append(_mesh(each.mesh))
    content = {
        "schema": SCHEMA,
        "file": name,
        "fps": fps,
        "methods": list(methods),
        "low_index": LOW,
        "bulge_ratio": BULGE,
        "clips": [{"clip": clip, "meshes": listed} for clip, listed in clips.items()],
        "advice": list(advice(found)),
    }
    return json.dumps(content, allow_nan=False, ensure_ascii=False, indent=1) + "\n"


def _mesh(mesh: MeshCollapse) -> dict[str, Any]:
    worst = mesh.worst
    return {
        "mesh": mesh.mesh,
        "node": mesh.node,
        "vertices": mesh.vertices,
        "index": worst.index,
        "vertex": worst.vertex,
        "time_s": worst.time,
        "joint": worst.joint,
        "other_joint": worst.other,
        "angle_deg": math.degrees(worst.angle),
        "twist": worst.twist,
        "share_below_low": mesh.low,
        "share_inverted": mesh.inverted,
        "share_of_faces_closed": mesh.closed,
        "methods": [_fared(each, mesh) for each in mesh.methods],
    }


def _fared(fared: Fared, mesh: MeshCollapse) -> dict[str, Any]:
    about: dict[str, Any] = {"method": fared.method}
    if fared.volume is not None:
        about |= {
            "volume_min": float(fared.volume.min()),
            "volume_min_time_s": float(mesh.times[fared.volume.argmin()]),
            "volume_max": float(fared.volume.max()),
        }
    return about | {
        "bulge_max": fared.bulge,
        "bulge_vertex": fared.vertex,
        "bulge_joint": fared.joint,
        "bulge_time_s": fared.time,
        "share_bulging": fared.bulging,
    }
