"""`gltf-anim bake`: every vertex at every frame, skinned by a method of choice, as a vertex cache."""

from __future__ import annotations

import time
from contextlib import AbstractContextManager
from enum import StrEnum
from typing import Annotated

import typer

from anim.gltf.io.source import Source
from anim.gltf.reading import reader
from anim.measure.equal_clips import first_equal
from anim.model import Clip, Scene
from anim.operations.selection import Selection
from anim.skinning.bake import SPACES, bakeable_instances
from cli import text, units
from cli.errors import UsageError
from cli.io import cache_files, documents, scenes
from cli.io.cache_folders import StagedFolder
from cli.options import caches, common, meshes
from cli.options.meshes import ABOUT, Method
from cli.progress import announce_compiling
from cli.reports import bake_notes, image_notes
from cli.reports.bake_report import report_notes, summarize_files
from cli.reports.rotation_notes import normalized_keys_note
from cli.text import Reporter
from cli.workflows.bake_clip import BakeOptions, default_directions, keeps_materials, keeps_nodes
from cli.workflows.bake_jobs import PLACEHOLDERS, bake_jobs, mesh_groups
from cli.workflows.bake_run import BakeRun, FileOptions

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
    max_files: common.MaxFiles = None,
    html: common.Html = None,
    dry_run: common.DryRun = False,
    quiet: common.Quiet = False,
    verbose: common.Verbose = False,
) -> None:
    """Bake skinning and morph targets to a vertex cache, also by methods that glTF players lack.

    Vertices are in scene order, those of all scenes: nodes depth-first, primitives as in the file, vertices as in their
    accessors. Skinned meshes are in world space, and the transform of their own node is ignored. If there are several
    clips, OUT must contain {clip}, which is replaced by the name of each; {mesh} in OUT writes a file per mesh. Folders
    of such names are made.

    Skin weights are divided by their sum, as players do. A warning names methods that move a vertex farther from lbs
    than the model's size. For joints with non-uniform scale, tools define all methods except lbs differently: here each
    joint first scales the mesh about its own position, then rotates it.

    A .glb or .gltf is the source file with other vertices: its materials, images, texture coordinates, colors, extras
    and extensions stay, and so do unskinned meshes, cameras and lights with their channels. Skins and the channels of
    joints are left out, or stay with --keep-skeleton; so are meshes that --mesh does not select, and other clips.
    USD has the materials as UsdPreviewSurface; their images are in a .usdz, and beside a .usdc or .usda.
    The mesh of a texture keeps them too, and has its look-up in the next free set of texture coordinates.
    """
    reporter = Reporter(quiet, verbose)
    began = time.perf_counter()
    if fps is not None and fps <= 0:
        raise UsageError(f"--fps is {fps:g} (expected a number above 0)")
    ending = cache_files.check(output, None if format is None else f".{format}", PLACEHOLDERS)
    values = {
        "quantize": quantize,
        "layout": layout,
        "preset": preset,
        "depth": depth,
        "rest_mesh": rest_mesh,
        "max_targets": max_targets,
    }
    units.warn_without_unit(max_error, "--max-error", reporter.warn)
    files = FileOptions(ending, values, max_error, up, vertex_order, keep_skeleton, dry_run)
    files.check(normals=bool(normals), tangents=bool(tangents))
    if html is not None:
        from cli.workflows.cache_page import check_cache_page, commit_cache_page_after  # imports all readers of curves

        moved = {"--space mesh": space is not WORLD, "--up": up is not None, "--vertex-order": vertex_order is not None}
        check_cache_page(html, input, output, changed=[name for name, is_given in moved.items() if is_given])
    with documents.source(input, reporter) as source:
        document = source.document
        clips = reader.clips(document)
        scene = _read_scene(source, mesh, ending, reporter, normals=normals, tangents=tangents)
        clip_indices = Selection(clip or ()).chosen_clips(reader.names(document))
        nodes = meshes.nodes(scene, mesh)
        baked_nodes = [each.node for each in bakeable_instances(scene, rigid=rigid, nodes=nodes)]
        scenes.warn_of_other_scenes(document, source.name, reporter, baked_nodes)
        groups = mesh_groups(scene, nodes, output, rigid=rigid)
        jobs = bake_jobs(output, ending, groups, [(clips[i].name, i) for i in clip_indices], max_files)
        if html is not None and len(jobs) > 1:
            raise UsageError(f"--html shows one clip and one file, not {len(jobs)} (choose with --clip)")
        lit, mapped = default_directions(document, scene, nodes, ending, rigid=rigid)
        tangents = (mapped and normals is not False) if tangents is None else tangents
        normals = lit if normals is None else normals
        options = BakeOptions(method.value, blend, bulge_clamp, space.value, normals, tangents, rigid, fps, start, end)
        announce_compiling(reporter)
        bake_notes.clamped_range_note(
            [(reader.clip_label(clips[i].name, i), clips[i]) for i in clip_indices], start, end, reporter
        )
        if not rigid and not keeps_nodes(ending) and bakeable_instances(scene, nodes=nodes):
            bake_notes.left_out_note(scene, nodes, reporter)

        def commit_with(staged: StagedFolder) -> AbstractContextManager[None]:
            if html is None:
                return cache_files.commit_alone(staged)
            (job,) = jobs
            chosen = [] if job.clip is None else [f"#{job.clip}"]
            return commit_cache_page_after(html, (input, job.file), staged, chosen, reporter, dry_run=dry_run)

        run = BakeRun(source, scene, options, files, reporter, commit_with)
        played = [Clip("", ()) if job.clip is None else clips[job.clip] for job in jobs]
        first = first_equal([(each,) for each in played]) if len(jobs) > 1 else [-1]
        for job, each, n in zip(jobs, played, first, strict=True):
            run.bake(job, groups[job.group][1], each, first=n)
            if len(jobs) > 1:
                reporter.verbose_info(f"  {summarize_files(run.files[-1:], method.value)}")
    report_notes(run.files, reporter)
    normalized_keys_note({job.clip: clips[job.clip] for job in jobs if job.clip is not None}, reporter)
    run.report_findings()
    if ending == ".gltf" and not dry_run:
        image_notes.report(document, source, jobs[0].file, reporter)
    took = text.format_duration(time.perf_counter() - began) + (text.DRY if dry_run else "")
    reporter.info(f"{summarize_files(run.files, method.value)}, {took}")


def _read_scene(
    source: Source,
    mesh: list[str] | None,
    ending: str,
    reporter: Reporter,
    *,
    normals: bool | None,
    tangents: bool | None,
) -> Scene:
    """Return the scene with the normals and tangents that may be baked; None: by default of the format."""
    by_default = keeps_materials(ending)
    return scenes.read_scene(
        source.document,
        source.name,
        reporter,
        normals=bool(normals or tangents) or (normals is None and by_default),
        tangents=bool(tangents) or (normals is not False and tangents is None and by_default),
        nodes=lambda scene: meshes.nodes(scene, mesh),
    )
