"""`gltf-anim convert-cache`: a vertex cache in another format."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack
from dataclasses import replace
from typing import Annotated, Any

import typer

from anim.caches.options import ReadOptions
from anim.caches.registry import CACHE_FORMATS, READABLE
from anim.caches.transforms import resample, statistics, up_axis
from anim.caches.transforms.vertex_order import reorder
from anim.model import FrameChunk, VertexCache
from anim.units import plural
from cli import text, units
from cli.errors import UsageError
from cli.io import cache_files, documents
from cli.io.cache_folders import StagedFolder
from cli.options import caches, common
from cli.progress import Progress, announce_compiling
from cli.reports import image_notes
from cli.workflows.bake_clip import Output, choose_clip, onto_source
from cli.workflows.cache_page import check_cache_page, commit_cache_page_after

Cache = Annotated[
    str,
    typer.Argument(metavar="IN", help=f"A cache: {', '.join(READABLE)}; '-' for stdin.", show_default=False),
]


def command(
    input: Cache = "-",
    output: caches.Product = "-",
    *,
    format: caches.FormatOption = None,
    at: Annotated[
        float | None, typer.Option("--at", metavar="S", help="Write only the frame at this time, in seconds.")
    ] = None,
    fps: Annotated[
        float | None,
        typer.Option("--fps", metavar="N", help="Frames per second; frames are interpolated linearly."),
    ] = None,
    input_fps: Annotated[
        float | None,
        typer.Option("--input-fps", metavar="N", help="Frames per second of an IN that stores none (PC2: 24)."),
    ] = None,
    up: caches.UpOption = None,
    vertex_order: caches.VertexOrderOption = None,
    onto: Annotated[
        str | None,
        typer.Option(
            "--onto",
            metavar="FILE",
            help=f"{', '.join(caches.formats_with_materials())}: the glTF file of which IN is a bake; OUT keeps its "
            "materials and texture coordinates.",
            show_default=False,
        ),
    ] = None,
    clip: Annotated[
        list[str] | None,
        typer.Option("--clip", metavar="GLOB", help="With --onto: the clip of FILE that IN is a bake of."),
    ] = None,
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
) -> None:
    """Convert a vertex cache to another format, frame by frame.

    Frames are streamed, so caches of any length fit into memory, except .glb morph targets (up to 1 GB of positions)
    and textures (up to 4096 × 8192 pixels). The extension of a name selects its format. For names without one, IN is
    recognized by its first bytes, and --format selects that of OUT.

    PC2 and MDD get a companion rest mesh (walk.pc2-rest.ply) with the same vertex order; for Blender's Mesh Cache
    modifier use --up z --vertex-order blender. Frame sequences (.ply, .obj, .stl) are numbered: walk_00001.ply.
    With --onto, a .glb is that file with other vertices, as bake writes it; IN has its vertices in the order of the
    file, in world space. If it has several clips, --clip selects that of IN, whose channels of other nodes then stay.

    Textures (.exr, .png) get a companion JSON file and mesh. A pipe carries one file: no textures, and only one frame
    of a sequence. Meshes of a USD may move by points, transforms, skeletons and blend shapes. One with Z up gets Y up
    as .glb, .gltf and .abc; without --up, other formats have the up axis of IN.
    """
    reporter = text.Reporter(quiet)
    began = time.perf_counter()
    if fps is not None and fps <= 0:
        raise UsageError(f"--fps is {fps:g} (expected a number above 0)")
    if at is not None and fps is not None:
        raise UsageError("--at and --fps exclude each other")
    ending = cache_files.check(output, None if format is None else f".{format}")
    given: dict[str, Any] = {
        "quantize": quantize,
        "layout": layout,
        "preset": preset,
        "depth": depth,
        "rest_mesh": rest_mesh,
        "max_targets": max_targets,
    }
    if onto is None and keep_skeleton:
        raise UsageError("--keep-skeleton needs --onto FILE, whose skeleton it keeps")
    if onto is None and clip is not None:
        raise UsageError(
            "--clip needs --onto FILE: it names the clip of FILE that IN is a bake of (a cache is one motion)",
            help="to bake a clip of a glTF file: gltf-anim bake IN OUT --clip GLOB",
        )
    moved = {"--up": up is not None, "--vertex-order": vertex_order is not None}
    check_cache_page(html, input, output, changed=[name for name, is_given in moved.items() if is_given])
    # Raises before any work for options that the format doesn't support.
    caches.write_options(ending, given | {"max_error": max_error, "onto": onto})
    with ExitStack() as stack:
        loaded = stack.enter_context(cache_files.load(input, ReadOptions(input_fps)))
        if input_fps is not None and "input_fps" not in CACHE_FORMATS[loaded.ending].takes:
            raise UsageError(f"--input-fps does not apply to {loaded.ending}, which stores its frame times")
        if loaded.ending in (".glb", ".gltf"):
            announce_compiling(reporter)
        cache = _changed(loaded.cache, at, fps, up or CACHE_FORMATS[ending].up, vertex_order)
        if max_error is not None:
            given["max_error"] = units.parse_bound(
                max_error, "--max-error", lambda: statistics.diagonal(cache), reporter.warn
            )
        if onto is not None:
            source = stack.enter_context(documents.source(onto, reporter))
            number = choose_clip(source, clip)
            cache, given["source"] = onto_source(
                cache, source, number, keep_skeleton=keep_skeleton, output=Output(output, ending, dry_run)
            )
        writing = caches.write_options(ending, given)
        progress = Progress(loaded.name, cache.frame_count, shown=not quiet)

        def commit_with(staged: StagedFolder) -> AbstractContextManager[None]:
            progress.close()  # whose bar is not for this
            if html is None:
                return cache_files.commit_alone(staged)
            return commit_cache_page_after(html, (input, output), staged, (), reporter, dry_run=dry_run)

        counted = _counted(cache, progress)
        try:
            saved = cache_files.save(counted, output, writing, ending=ending, dry_run=dry_run, commit_with=commit_with)
        finally:
            progress.close()
        size = loaded.size
    if cache.chosen:
        reporter.warn(f"{cache.chosen}; bake takes others by --clip")
    for words in loaded.notes:
        reporter.warn(words)
    saved.report(reporter)
    if onto is not None and ending == ".gltf" and not dry_run:
        image_notes.report(source.document, source, output, reporter)
    name = loaded.name if output == documents.PIPE else output
    parts = [
        f"{name}  {text.format_change(size, saved.size)}",
        f"{plural(cache.frame_count, 'frame')} of {cache.vertex_count} vertices",
    ]
    if saved.written.max_error is not None:
        parts.append(f"max {text.format_length(saved.written.max_error)}")
    if len(saved.files) > 1:
        parts.append(f"{len(saved.files)} files")
    parts.append(text.format_duration(time.perf_counter() - began))
    reporter.info(", ".join(parts) + (" (dry run: nothing written)" if dry_run else ""))


def _changed(cache: VertexCache, at: float | None, fps: float | None, up: str, chosen: str | None) -> VertexCache:
    """The cache with other frames, up axis ("" for its own) and vertex order."""
    if at is not None:
        cache = resample.at_time(cache, at)
    if fps is not None:
        cache = resample.at_rate(cache, fps)
    if chosen is not None:
        cache = reorder(cache, str(chosen))
    return up_axis.to_up_axis(cache, str(up or cache.up))


def _counted(cache: VertexCache, progress: Progress) -> VertexCache:
    """The cache with its reading reported to `progress`."""

    def chunks() -> Iterator[FrameChunk]:
        for chunk in cache.chunks():
            yield chunk
            progress(chunk.first + len(chunk.positions))

    return replace(cache, chunks=chunks)
