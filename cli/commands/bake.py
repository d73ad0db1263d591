"""`gltf-anim bake`: every vertex at every frame, skinned by a method of choice, as a vertex cache."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import PurePath
from typing import Annotated

import typer

from anim.arrays import Floats
from anim.caches.transforms import statistics, up_axis
from anim.caches.transforms import vertex_order as orders
from anim.gltf.reading import reader
from anim.model import Clip, Scene, VertexCache
from anim.operations.selection import Selection
from anim.sampling.times import frame_times
from anim.skinning.analysis.inbetween_error import InbetweenError, inbetween_error
from anim.skinning.analysis.method_deviation import Deviation, MeasuredBake, linear_baker
from anim.skinning.bake import SPACES, Baker, bakeable_instances, prepare_bake
from anim.skinning.uneven import UnevenScale
from cli import text, units
from cli.errors import UsageError
from cli.io import cache_files, documents, output_names, scenes
from cli.io.cache_files import SavedCache
from cli.options import caches, common, meshes
from cli.options.meshes import ABOUT, Method
from cli.progress import Progress, announce_compiling
from cli.reports import bake_notes
from cli.text import Reporter, plural

PLACEHOLDERS = ("mesh", "clip")
MAX_LISTED_FILES = 8  # files in a note

LBS = Method("lbs")
Space = StrEnum("Space", [(name, name) for name in SPACES])  # type: ignore[misc]
WORLD = Space("world")


def command(
    input: common.Input = "-",
    output: caches.Product = "-",
    *,
    method: Annotated[Method, typer.Option("--method", help=ABOUT)] = LBS,
    blend: Annotated[
        float | None,
        typer.Option("--blend-weight", metavar="0..1", help="Blend weight of the method against lbs.", min=0, max=1),
    ] = None,
    bulge_clamp: Annotated[
        bool,
        typer.Option(
            "--bulge-clamp", help="Limit the distance of vertices from their joints' segments to that in the rest pose."
        ),
    ] = False,
    fps: Annotated[
        float | None,
        typer.Option("--fps", metavar="N", help="Frames per second (default: one frame per key of the clip)."),
    ] = None,
    clip: common.Clips = None,
    mesh: meshes.Meshes = None,
    space: Annotated[Space, typer.Option("--space", help="world: of the scene; mesh: of the mesh's own node.")] = WORLD,
    normals: Annotated[
        bool, typer.Option("--normals", help=f"Bake normals too ({', '.join(caches.formats_with('normals'))}).")
    ] = False,
    tangents: Annotated[
        bool,
        typer.Option(
            "--vertex-tangents", help=f"Bake normals and tangents ({', '.join(caches.formats_with('tangents'))})."
        ),
    ] = False,
    rigid: Annotated[bool, typer.Option("--rigid", help="Bake unskinned meshes too.")] = False,
    format: caches.FormatOption = None,
    up: caches.UpOption = None,
    vertex_order: caches.VertexOrderOption = None,
    max_error: caches.MaxError = None,
    quantize: caches.Quantize = False,
    layout: caches.LayoutOption = None,
    preset: caches.PresetOption = None,
    depth: caches.DepthOption = None,
    rest_mesh: caches.RestMeshOption = None,
    dry_run: common.DryRun = False,
    quiet: common.Quiet = False,
    verbose: common.Verbose = False,
) -> None:
    """Bake skinning and morph targets to a vertex cache, also by methods that glTF players lack.

    Vertices are in scene order, those of all scenes: nodes depth-first, primitives as in the file, vertices as in their
    accessors. Skinned meshes are in world space, and the transform of their own node is ignored. If there are several
    clips, OUT must contain {clip}, which is replaced by the name of each; {mesh} in OUT writes a file per mesh.

    Skin weights are divided by their sum, as players do. A warning names methods that move a vertex farther from lbs
    than the model's size. For joints with non-uniform scale, tools define all methods except lbs differently: here each
    joint first scales the mesh about its own position, then rotates it.
    """
    voice = Reporter(quiet, verbose)
    began = time.perf_counter()
    if fps is not None and fps <= 0:
        raise UsageError(f"--fps is {fps:g} (expected a number above 0)")
    ending = cache_files.check(output, None if format is None else f".{format}", PLACEHOLDERS)
    given = {"quantize": quantize, "layout": layout, "preset": preset, "depth": depth, "rest_mesh": rest_mesh}
    # Raises before any work for options that the format doesn't support.
    caches.write_options(ending, given | {"max_error": max_error})
    caches.check_supported(ending, normals=normals, tangents=tangents)
    done: list[_Done] = []
    with documents.source(input, voice) as source:
        document = source.document
        clips = reader.clips(document)
        scene = scenes.read_scene(
            document,
            source.name,
            voice,
            normals=normals or tangents,
            tangents=tangents,
            nodes=lambda scene: meshes.nodes(scene, mesh),
        )
        numbers = Selection(clip or ()).chosen_clips(reader.names(document))
        nodes = meshes.nodes(scene, mesh)
        chosen = [each.node for each in bakeable_instances(scene, rigid=rigid, nodes=nodes)]
        scenes.warn_of_other_scenes(document, source.name, voice, chosen)
        groups = _groups(scene, nodes, output, rigid=rigid)
        jobs = _jobs(output, ending, groups, [(clips[i].name, i) for i in numbers])
        announce_compiling(voice)
        if not rigid and bakeable_instances(scene, nodes=nodes):
            bake_notes.left_out_note(scene, nodes, voice)
        missed: list[tuple[str, InbetweenError]] = []
        made: dict[int, Baker] = {}
        linear: Baker | None = None
        scales: UnevenScale | None = None
        deviations: list[tuple[str, Deviation]] = []
        uneven: set[int] = set()
        for job in jobs:
            if job.group not in made:
                made = {
                    job.group: prepare_bake(
                        scene,
                        method=method.value,
                        blend=blend,
                        bulge_clamp=bulge_clamp,
                        space=space.value,
                        normals=normals or tangents,
                        tangents=tangents,
                        rigid=rigid,
                        nodes=groups[job.group][1],
                    )
                }
                if method is not LBS:
                    linear = linear_baker(made[job.group], space=space.value)
                    scales = UnevenScale(made[job.group])
            each = Clip("", ()) if job.clip is None else clips[job.clip]
            times, label = _times(each, fps), reader.clip_label(each.name, job.clip or 0)
            if scales is not None:
                uneven.update(scales.joints(each, times))
            if fps is None:
                missed.append((label, inbetween_error(made[job.group], each, times)))
            progress = Progress(PurePath(job.file).name, len(times), shown=not quiet)
            measured = None if linear is None else MeasuredBake(made[job.group], linear, each, times, progress)
            baked = made[job.group].bake(each, times=times, progress=progress) if measured is None else measured.cache
            cache = _turned(baked, up, vertex_order)
            try:
                writing = caches.write_options(ending, given | {"max_error": _meters(max_error, cache)})
                saved = cache_files.save(cache, job.file, writing, ending=ending, dry_run=dry_run)
            except BaseException:
                _report_written(done, voice, dry_run=dry_run)
                raise
            finally:
                progress.close()
            if measured is not None:
                deviations.append((label, measured.deviation()))
            done.append(_Done(job.file, each.name, job.clip, job.group, len(times), cache.vertex_count, saved))
            if len(jobs) > 1:
                voice.verbose_info(f"  {_summary(done[-1:], method.value)}")
        at_rest = made[jobs[-1].group].rest
    _report_notes(done, voice)
    bake_notes.frame_gap_note(missed, at_rest, voice)
    bake_notes.lost_data_notes(deviations, method.value, voice)
    bake_notes.uneven_scale_note(sorted(uneven), scene, method.value, voice)
    took = text.format_duration(time.perf_counter() - began) + (" (dry run: nothing written)" if dry_run else "")
    voice.info(f"{_summary(done, method.value)}, {took}")


@dataclass(frozen=True, slots=True)
class _Job:
    """An output file to write: indices of its meshes and of its clip; None for a file without clips."""

    file: str
    group: int
    clip: int | None


@dataclass(frozen=True, slots=True)
class _Done:
    """One clip baked into a file. number: index of the clip. group: index of the mesh group."""

    file: str
    clip: str
    number: int | None
    group: int
    frames: int
    vertices: int
    saved: SavedCache


Group = tuple[str, Sequence[int] | None]  # value of {mesh}, and the nodes of the meshes; None for all


def _groups(scene: Scene, nodes: Sequence[int] | None, output: str, *, rigid: bool) -> list[Group]:
    """Meshes grouped by output file: one group per mesh if OUT contains {mesh}."""
    if "{mesh}" not in output:
        return [("", nodes)]
    chosen = {each.node: each.mesh.name for each in bakeable_instances(scene, rigid=rigid, nodes=nodes)}
    return [(name or scene.skeleton.names[node], [node]) for node, name in chosen.items()] or [("", nodes)]


def _jobs(output: str, ending: str, groups: Sequence[Group], clips: Sequence[tuple[str, int]]) -> list[_Job]:
    """All output files, with their names expanded and checked. clips: name and index of each."""
    if "{clip}" not in output and len(clips) > 1:
        raise UsageError(
            f"{len(clips)} clips are chosen, but '{output}' holds one",
            help="choose one with --clip, or put {clip} into OUT for a file per clip",
        )
    each_clip: Sequence[tuple[str, int | None]] = clips or [("", None)]
    pairs = [(i, name, clip) for i in range(len(groups)) for name, clip in each_clip]
    rows = [{"mesh": groups[i][0], "clip": name} for i, name, _ in pairs]
    by_clip = "{clip}" in output
    files = output_names.expand(output, rows, [(clip or 0) if by_clip else i for i, _, clip in pairs])
    for file in files if len(files) > 1 or "{" in output else ():
        cache_files.check(file, ending, placeholders=None)
    return [_Job(file, i, clip) for file, (i, _, clip) in zip(files, pairs, strict=True)]


def _report_written(done: Sequence[_Done], voice: Reporter, *, dry_run: bool) -> None:
    """Report the files already written when a later one fails."""
    if done and not dry_run:
        names = ", ".join(each.file for each in done[:MAX_LISTED_FILES])
        more = f" and {len(done) - MAX_LISTED_FILES} more" if len(done) > MAX_LISTED_FILES else ""
        voice.info(f"note: {plural(len(done), 'file')} written before: {names}{more}")


def _turned(cache: VertexCache, up: str | None, order: str | None) -> VertexCache:
    if order is not None:
        cache = orders.reorder(cache, str(order))
    return cache if up is None else up_axis.to_up_axis(cache, str(up))


def _meters(max_error: str | None, cache: VertexCache) -> float | None:
    return (
        None if max_error is None else units.parse_length(max_error, "--max-error", lambda: statistics.diagonal(cache))
    )


def _report_notes(done: list[_Done], voice: Reporter) -> None:
    """Report every note once, with its files unless it applies to all."""
    files: dict[str, list[str]] = {}
    for each in done:
        for note in each.saved.written.notes:
            files.setdefault(note, []).append(PurePath(each.file).name)
    for note, names in files.items():
        more = f" and {len(names) - MAX_LISTED_FILES} more" if len(names) > MAX_LISTED_FILES else ""
        where = f"{', '.join(names[:MAX_LISTED_FILES])}{more}: " if len(names) < len(done) else ""
        voice.info(f"note: {where}{note}")


def _summary(done: list[_Done], method: str) -> str:
    file = "stdout" if done[0].file == documents.PIPE else done[0].file
    name = file if len(done) == 1 else f"{_count(done)}, {file} …"
    frames = plural(sum(each.frames for each in done), "frame")
    of = f" of '{done[0].clip}'" if len({each.number for each in done}) == 1 and done[0].clip else ""
    parts = [f"{name}  {text.format_bytes(sum(each.saved.size for each in done))}", f"{method}{of}"]
    vertices = sorted({each.vertices for each in done})
    parts.append(f"{frames} of {' to '.join(map(str, dict.fromkeys((vertices[0], vertices[-1]))))} vertices")
    errors = [each.saved.written.max_error for each in done if each.saved.written.max_error is not None]
    parts += [f"max {text.format_length(max(errors))} at frames"] if errors else []
    count = sum(len(each.saved.files) for each in done)
    return ", ".join([*parts, *([plural(count, "file")] if count > len(done) else [])])


def _count(done: list[_Done]) -> str:
    """Return "2 clips", "2 meshes", or "2 meshes of 3 clips"."""
    clips, meshes = plural(len({each.number for each in done}), "clip"), len({each.group for each in done})
    if meshes == 1:
        return clips
    return f"{meshes} meshes of {clips}"


def _times(clip: Clip, fps: float | None) -> Floats:
    if fps is not None:
        return frame_times(clip.start, clip.end, fps=fps)
    return clip.key_times
