"""`gltf-anim bake`: every vertex at every frame, skinned by a method of choice, as a vertex cache."""

from __future__ import annotations

import time
from dataclasses import dataclass
from enum import StrEnum
from pathlib import PurePath
from typing import Annotated

import numpy as np
import typer

from anim.arrays import Floats, sorted_unique
from anim.caches import axes, extent
from anim.caches import order as orders
from anim.gltf import read
from anim.model import Clip, VertexCache
from anim.ops.selection import Selection
from anim.sampling.times import grid
from anim.skinning.bake import SPACES, baked, baker
from anim.skinning.between import Missed, between
from cli import bake_notes, cache_files, cache_options, meshes, options, report, streams, units
from cli.cache_files import Saved
from cli.errors import UsageError
from cli.progress import Progress
from cli.report import Voice, plural
from cli.skinning_methods import ABOUT, Method

PLACE = "{clip}"  # in OUT: where the name of the clip goes
FORBIDDEN = frozenset('/\\:*?"<>|')  # what some file system doesn't take in a name

LBS = Method("lbs")
Space = StrEnum("Space", [(name, name) for name in SPACES])  # type: ignore[misc]
WORLD = Space("world")


def bake(
    input: options.Input = "-",
    output: cache_options.Product = "-",
    *,
    method: Annotated[Method, typer.Option("--method", help=ABOUT)] = LBS,
    blend: Annotated[
        float | None,
        typer.Option("--blend", metavar="0..1", help="Share of the method; the rest is lbs.", min=0, max=1),
    ] = None,
    bulge_clamp: Annotated[
        bool, typer.Option("--bulge-clamp", help="Keep skin no farther from the links between joints than at rest.")
    ] = False,
    fps: Annotated[
        float | None,
        typer.Option("--fps", metavar="N", help="Frames per second; without it one frame per key of the clip."),
    ] = None,
    clip: options.Clips = None,
    mesh: meshes.Meshes = None,
    space: Annotated[Space, typer.Option("--space", help="world: of the scene. mesh: of the mesh's own node.")] = WORLD,
    normals: Annotated[
        bool, typer.Option("--normals", help=f"Bake normals too ({', '.join(cache_options.holding('normals'))}).")
    ] = False,
    tangents: Annotated[
        bool,
        typer.Option("--tangents", help=f"Bake normals and tangents ({', '.join(cache_options.holding('tangents'))})."),
    ] = False,
    rigid: Annotated[bool, typer.Option("--rigid", help="Bake meshes that only nodes move, too.")] = False,
    format: cache_options.FormatOption = None,
    up: cache_options.UpOption = None,
    order: cache_options.OrderOption = None,
    max_error: cache_options.MaxError = None,
    quantize: cache_options.Quantize = False,
    layout: cache_options.LayoutOption = None,
    preset: cache_options.PresetOption = None,
    depth: cache_options.DepthOption = None,
    rest: cache_options.RestOption = None,
    dry_run: options.DryRun = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
) -> None:
    """Bake skinning and morph targets to a vertex cache, by a method that glTF itself can't play.

    Vertices come in the order of the scene: nodes depth-first, primitives as in the file, vertices as in their
    accessors. Skinned meshes are in world space, where their own node doesn't count. Several clips need {clip} in OUT,
    which is replaced by each name. Skin weights count as they are stored; dqs and cor take them as shares of their sum.
    """
    voice = Voice(quiet, verbose)
    began = time.perf_counter()
    if fps is not None and fps <= 0:
        raise UsageError(f"--fps is {fps:g} (expected a number above 0)")
    ending = cache_files.check(output, None if format is None else f".{format}")
    given = {"quantize": quantize, "layout": layout, "preset": preset, "depth": depth, "rest": rest}
    cache_options.writing(ending, given | {"max_error": max_error})  # refuses at once what the format doesn't take
    cache_options.check_held(ending, normals=normals, tangents=tangents)
    done: list[_Done] = []
    with streams.source(input) as source:
        document = source.document
        clips, scene = read.clips(document), read.scene(document, normals=normals or tangents, tangents=tangents)
        numbers = Selection(clip or ()).chosen_clips(read.names(document))
        files = _files(output, [(clips[i].name, i) for i in numbers])
        nodes = meshes.nodes(scene, mesh)
        bake_notes.weights(baked(scene, nodes=nodes), method.value, voice)
        made = baker(
            scene,
            method=method.value,
            blend=blend,
            bulge_clamp=bulge_clamp,
            space=space.value,
            normals=normals or tangents,
            tangents=tangents,
            rigid=rigid,
            nodes=nodes,
        )
        if not rigid:
            bake_notes.left_out(scene, nodes, voice)
        missed: list[tuple[str, Missed]] = []
        for each, file in zip([clips[i] for i in numbers] or [Clip("", ())], files, strict=True):
            times = _times(each, fps)
            if fps is None and not quiet:
                label = read.label(each.name, numbers[len(done)] if numbers else 0)
                missed.append((label, between(made, each, times)))
            progress = Progress(PurePath(file).name, len(times), shown=not quiet)
            cache = _turned(made.bake(each, times=times, progress=progress), up, order)
            try:
                writing = cache_options.writing(ending, given | {"max_error": _meters(max_error, cache)})
                saved = cache_files.save(cache, file, writing, ending=ending, dry_run=dry_run)
            finally:
                progress.close()
            done.append(_Done(file, each.name, len(times), saved))
            _say_notes(done, voice)
            if len(files) > 1:
                voice.detail(f"  {_summary(done[-1:], cache.vertex_count, method.value)}")
    bake_notes.gaps(missed, made.rest, voice)
    took = f"{time.perf_counter() - began:.1f} s" + (" (dry run: nothing written)" if dry_run else "")
    voice.say(f"{_summary(done, made.vertices, method.value)}, {took}")


@dataclass(frozen=True, slots=True)
class _Done:
    """One clip that was baked into a file."""

    file: str
    clip: str
    frames: int
    saved: Saved


def _files(output: str, clips: list[tuple[str, int]]) -> list[str]:
    """One output per clip, the clip's name in the place of {clip}; a name that is taken gets the clip's number."""
    if PLACE not in output:
        if len(clips) > 1:
            raise UsageError(
                f"{len(clips)} clips are chosen, but '{output}' holds one",
                help=f"choose one with --clip, or put {PLACE} into OUT for a file per clip",
            )
        return [output]
    names: list[str] = []
    for name, number in clips or [("", 0)]:
        plain = "".join("_" if c in FORBIDDEN or not c.isprintable() else c for c in name).strip(". ") or str(number)
        taken = {each.casefold() for each in names}  # to some file systems "Walk" and "walk" are one name
        while (file := output.replace(PLACE, plain)).casefold() in taken:
            plain += f"-{number}"
        names.append(file)
    return names


def _turned(cache: VertexCache, up: str | None, order: str | None) -> VertexCache:
    if order is not None:
        cache = orders.ordered(cache, str(order))
    return cache if up is None else axes.turned(cache, str(up))


def _meters(max_error: str | None, cache: VertexCache) -> float | None:
    return None if max_error is None else units.meters(max_error, "--max-error", lambda: extent.diagonal(cache))


def _say_notes(done: list[_Done], voice: Voice) -> None:
    """Notes of the last file that none before it had."""
    told = {note for each in done[:-1] for note in each.saved.written.notes}
    for note in done[-1].saved.written.notes:
        if note not in told:
            voice.say(f"note: {note}")


def _summary(done: list[_Done], vertices: int, method: str) -> str:
    file = "stdout" if done[0].file == streams.PIPE else done[0].file
    name = file if len(done) == 1 else f"{plural(len(done), 'clip')}, {file} …"
    frames = plural(sum(each.frames for each in done), "frame")
    of = f" of '{done[0].clip}'" if len(done) == 1 and done[0].clip else ""
    parts = [f"{name}  {report.size(sum(each.saved.size for each in done))}", f"{method}{of}"]
    parts.append(f"{frames} of {vertices} vertices")
    errors = [each.saved.written.max_error for each in done if each.saved.written.max_error is not None]
    parts += [f"max {report.length(max(errors))} at frames"] if errors else []
    count = sum(len(each.saved.files) for each in done)
    return ", ".join([*parts, *([plural(count, "file")] if count > len(done) else [])])


def _times(clip: Clip, fps: float | None) -> Floats:
    if fps is not None:
        return grid(clip.start, clip.end, fps=fps)
    return sorted_unique(np.concatenate(clip.axes)) if clip.axes else np.zeros(1)
