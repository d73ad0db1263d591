"""`gltf-anim bake`: every vertex at every frame, skinned by a method of choice, as a vertex cache."""

from __future__ import annotations

import time
from enum import StrEnum
from pathlib import PurePath
from typing import Annotated

import typer

from anim.caches.transforms import statistics, up_axis
from anim.caches.transforms import vertex_order as orders
from anim.gltf.reading import reader
from anim.model import Clip, VertexCache
from anim.operations.selection import Selection
from anim.skinning.analysis.inbetween_error import InbetweenError, InbetweenMetric
from anim.skinning.analysis.method_deviation import Deviation, MeasuredBake, linear_baker
from anim.skinning.bake import SPACES, Baker, bakeable_instances
from anim.skinning.uneven import UnevenScale
from cli import text, units
from cli.errors import UsageError
from cli.io import cache_files, documents, scenes
from cli.options import caches, common, meshes
from cli.options.meshes import ABOUT, Method
from cli.progress import Progress, announce_compiling
from cli.reports import bake_notes
from cli.reports.bake_report import BakedFile, report_notes, report_written, summarize_files
from cli.reports.rotation_notes import normalized_keys_note
from cli.text import Reporter
from cli.workflows.bake_clip import (
    BakeOptions,
    Output,
    default_directions,
    keeps_materials,
    keeps_nodes,
    source_options,
)
from cli.workflows.bake_jobs import PLACEHOLDERS, bake_jobs, mesh_groups
from cli.workflows.cache_page import check_cache_page, write_cache_page

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
    start: common.From = None,
    end: common.To = None,
    normals: Annotated[
        bool | None,
        typer.Option(
            "--normals/--no-normals",
            help=f"Bake normals too ({', '.join(caches.formats_with('normals'))}); by default for formats with "
            f"materials ({', '.join(caches.formats_with_materials(with_normals=True))}) if one is lit.",
            show_default=False,
        ),
    ] = None,
    tangents: Annotated[
        bool | None,
        typer.Option(
            "--vertex-tangents/--no-vertex-tangents",
            help=f"Bake normals and tangents ({', '.join(caches.formats_with('tangents'))}); by default likewise if "
            "all meshes have them and one has a normal map.",
            show_default=False,
        ),
    ] = None,
    rigid: Annotated[bool, typer.Option("--rigid", help="Bake unskinned meshes too.")] = False,
    format: caches.FormatOption = None,
    up: caches.UpOption = None,
    vertex_order: caches.VertexOrderOption = None,
    max_error: caches.MaxError = None,
    max_targets: caches.MaxTargets = None,
    keep_skeleton: caches.KeepSkeleton = False,
    quantize: caches.Quantize = False,
    layout: caches.LayoutOption = None,
    preset: caches.PresetOption = None,
    depth: caches.DepthOption = None,
    rest_mesh: caches.RestMeshOption = None,
    html: common.Html = None,
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

    A .glb or .gltf is the source file with other vertices: its materials, images, texture coordinates, colors, extras
    and extensions stay, and so do unskinned meshes, cameras and lights with their channels. Skins and the channels of
    joints are left out, or stay with --keep-skeleton; so are meshes that --mesh does not select, and other clips.
    USD has the materials as UsdPreviewSurface; their images are in a .usdz, and beside a .usdc or .usda.
    The mesh of a texture keeps them too, and has its look-up in the next free set of texture coordinates.
    """
    voice = Reporter(quiet, verbose)
    began = time.perf_counter()
    if fps is not None and fps <= 0:
        raise UsageError(f"--fps is {fps:g} (expected a number above 0)")
    ending = cache_files.check(output, None if format is None else f".{format}", PLACEHOLDERS)
    given = {
        "quantize": quantize,
        "layout": layout,
        "preset": preset,
        "depth": depth,
        "rest_mesh": rest_mesh,
        "max_targets": max_targets,
    }
    # Raises before any work for options that the format doesn't support.
    caches.write_options(ending, given | {"max_error": max_error})
    caches.check_supported(ending, normals=bool(normals), tangents=bool(tangents))
    if keep_skeleton and not keeps_nodes(ending):
        raise UsageError(f"--keep-skeleton does not apply to {ending}")
    moved = {"--space mesh": space is not WORLD, "--up": up is not None, "--vertex-order": vertex_order is not None}
    check_cache_page(html, input, output, changed=[name for name, is_given in moved.items() if is_given])
    done: list[BakedFile] = []
    with documents.source(input, voice) as source:
        document = source.document
        clips = reader.clips(document)
        scene = scenes.read_scene(
            document,
            source.name,
            voice,
            normals=bool(normals or tangents) or (normals is None and keeps_materials(ending)),
            tangents=bool(tangents) or (normals is not False and tangents is None and keeps_materials(ending)),
            nodes=lambda scene: meshes.nodes(scene, mesh),
        )
        numbers = Selection(clip or ()).chosen_clips(reader.names(document))
        nodes = meshes.nodes(scene, mesh)
        chosen = [each.node for each in bakeable_instances(scene, rigid=rigid, nodes=nodes)]
        scenes.warn_of_other_scenes(document, source.name, voice, chosen)
        groups = mesh_groups(scene, nodes, output, rigid=rigid)
        jobs = bake_jobs(output, ending, groups, [(clips[i].name, i) for i in numbers])
        if html is not None and len(jobs) > 1:
            raise UsageError(f"--html shows one clip and one file, not {len(jobs)} (choose with --clip)")
        lit, mapped = default_directions(document, scene, nodes, ending, rigid=rigid)
        tangents = (mapped and normals is not False) if tangents is None else tangents
        normals = lit if normals is None else normals
        options = BakeOptions(method.value, blend, bulge_clamp, space.value, normals, tangents, rigid, fps, start, end)
        announce_compiling(voice)
        bake_notes.clamped_range_note(
            [(reader.clip_label(clips[i].name, i), clips[i]) for i in numbers], start, end, voice
        )
        if not rigid and not keeps_nodes(ending) and bakeable_instances(scene, nodes=nodes):
            bake_notes.left_out_note(scene, nodes, voice)
        missed: list[tuple[str, InbetweenError]] = []
        made: dict[int, Baker] = {}
        metrics: dict[int, InbetweenMetric] = {}
        linear: Baker | None = None
        scales: UnevenScale | None = None
        deviations: list[tuple[str, Deviation]] = []
        uneven: set[int] = set()
        for job in jobs:
            if job.group not in made:
                made = {job.group: options.baker(scene, groups[job.group][1])}
                metrics = {job.group: InbetweenMetric(made[job.group])}
                if method is not LBS:
                    linear = linear_baker(made[job.group], space=space.value)
                    scales = UnevenScale(made[job.group])
            each = Clip("", ()) if job.clip is None else clips[job.clip]
            times, label = options.times(each), reader.clip_label(each.name, job.clip or 0)
            if scales is not None:
                uneven.update(scales.joints(each, times))
            missed.append((label, metrics[job.group].largest_error(each, times)))
            progress = Progress(PurePath(job.file).name, len(times), shown=not quiet)
            measured = None if linear is None else MeasuredBake(made[job.group], linear, each, times, progress)
            baked = made[job.group].bake(each, times=times, progress=progress) if measured is None else measured.cache
            cache = _turned(baked, up, vertex_order)
            looks = source_options(
                source,
                options,
                scene,
                groups[job.group][1],
                (job.clip, each),
                keep_skeleton=keep_skeleton,
                output=Output(job.file, ending, dry_run),
            )
            try:
                meters = _meters(max_error, cache)
                writing = caches.write_options(ending, given | {"max_error": meters, **looks})
                saved = cache_files.save(cache, job.file, writing, ending=ending, dry_run=dry_run)
            except BaseException:
                report_written(done, voice, dry_run=dry_run)
                raise
            finally:
                progress.close()
            if measured is not None:
                deviations.append((label, measured.deviation()))
            done.append(BakedFile(job.file, each.name, job.clip, job.group, len(times), cache.vertex_count, saved))
            if len(jobs) > 1:
                voice.verbose_info(f"  {summarize_files(done[-1:], method.value)}")
        at_rest = made[jobs[-1].group].rest
    report_notes(done, voice)
    normalized_keys_note({job.clip: clips[job.clip] for job in jobs if job.clip is not None}, voice)
    bake_notes.frame_gap_note(missed, at_rest, voice, is_chosen=fps is not None)
    bake_notes.lost_data_notes(deviations, method.value, voice)
    bake_notes.uneven_scale_note(sorted(uneven), scene, method.value, voice)
    took = text.format_duration(time.perf_counter() - began) + (" (dry run: nothing written)" if dry_run else "")
    voice.info(f"{summarize_files(done, method.value)}, {took}")
    if html is not None and not dry_run:
        played = [] if jobs[0].clip is None else [f"#{jobs[0].clip}"]
        written = str(PurePath(done[0].file).with_name(done[0].saved.files[-1]))
        write_cache_page(html, input, written, played, voice)


def _turned(cache: VertexCache, up: str | None, order: str | None) -> VertexCache:
    if order is not None:
        cache = orders.reorder(cache, str(order))
    return cache if up is None else up_axis.to_up_axis(cache, str(up))


def _meters(max_error: str | None, cache: VertexCache) -> float | None:
    return (
        None if max_error is None else units.parse_length(max_error, "--max-error", lambda: statistics.diagonal(cache))
    )
