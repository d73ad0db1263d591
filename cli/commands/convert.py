"""`gltf-anim convert`: .glb ↔ .gltf, and skinned USD."""

from __future__ import annotations

import time
from pathlib import PurePath
from typing import Annotated

import typer

from anim.gltf.io import container, images
from anim.gltf.io.source import external_files
from cli import text
from cli.errors import UsageError
from cli.io import documents
from cli.options import common
from cli.reports import image_notes
from cli.streams import record_files
from cli.workflows import many_files

USD_SUFFIXES = (".usdz", ".usdc", ".usda")
Output = Annotated[
    str,
    typer.Argument(
        metavar="OUT",
        help="A .glb, .gltf, .usdz, .usdc or .usda file, '-' for stdout (GLB).",
        show_default=False,
    ),
]


def command(
    input: common.Input = "-",
    output: Output = "-",
    more: common.More = None,
    *,
    out: common.Out = None,
    embed: Annotated[bool, typer.Option("--embed", help="Embed images and buffers, if their files exist.")] = False,
    clip: Annotated[
        list[str] | None,
        typer.Option("--clip", metavar="GLOB", help="USD: the clip with this name or index ('#0')."),
    ] = None,
    fps: Annotated[
        float | None,
        typer.Option(
            "--fps", metavar="N", help="USD: frames per second (default: those of the keys, else 60 and all keys)."
        ),
    ] = None,
    max_files: common.MaxFiles = None,
    dry_run: common.DryRun = False,
    quiet: common.Quiet = False,
) -> int:
    """Convert between .glb and .gltf, where nothing else changes, or to skinned USD.

    A .glb contains buffer 0 in its binary chunk, and further buffers as data URIs. A .gltf has a companion .bin file,
    with --embed data URIs. The rest of the JSON stays: numbers, order, extras, unknown extensions. If the output is in
    another folder, external images are copied beside it; --embed makes OUT one file.

    USD (extra usd) has the skeletons, skins and morph targets as UsdSkel, materials as UsdPreviewSurface, and one clip,
    sampled at a frame rate and interpolated linearly; a .usdz contains its images, for phones and other programs. If
    there are several clips, OUT must contain {clip}, or --clip selects one. Folders of such names are made. Unskinned
    meshes below joints are bound to the skeleton, so that all players move them. The stated error is that of the
    farthest vertex, skinned by USD, at frames and keys and half-way between.
    """
    reporter = text.Reporter(quiet)
    if fps is not None and fps <= 0:
        raise UsageError(f"--fps is {fps:g} (expected a number above 0)")

    def edit(input: str, output: str) -> None:
        if _is_usd(output):
            from cli.workflows import skinned_usd  # its skinning takes long to import

            if embed:
                raise UsageError("--embed does not apply to USD")
            skinned_usd.convert_to_usd(
                input, output, clips=clip, fps=fps, max_files=max_files, dry_run=dry_run, reporter=reporter
            )
            return
        for name, value in {"--clip": clip, "--fps": fps, "--max-files": max_files}.items():
            if value is not None:
                raise UsageError(f"{name} applies to USD only (.usdz, .usdc, .usda)")
        _convert(input, output, embed=embed, dry_run=dry_run, reporter=reporter)

    placeholders = ("clip",) if _is_usd(output) else ()
    return many_files.edit_named(
        input,
        output,
        more or (),
        out,
        edit,
        reporter,
        dry_run=dry_run,
        check=_check_extension,
        placeholders=placeholders,
    )


def _is_usd(path: str) -> bool:
    return PurePath(path).suffix.lower() in USD_SUFFIXES


def _check_extension(path: str) -> None:
    if not _is_usd(path):
        documents.check_extension(path)


def _convert(input: str, output: str, *, embed: bool, dry_run: bool, reporter: text.Reporter) -> None:
    began = time.perf_counter()
    if not dry_run:
        documents.check_output(output)
    with documents.source(input, reporter) as source:
        document = source.document
        if embed:
            record_files(*external_files(source))
            document = container.embed_buffers(images.embed(document, source.folder))
        size = documents.write(document, output, source, dry_run=dry_run, reporter=reporter)
    if not dry_run and (embed or output == documents.PIPE or not source.is_in_folder(output)):
        image_notes.warn_of_pipe(document, source.folder, output, reporter)
        for note in image_notes.notes(document, source.folder, image_notes.copied_names(output)):
            reporter.info(note)
    name = source.name if output == documents.PIPE else output
    reporter.info(
        f"{name}  {text.format_change(source.size, size)}, {text.format_duration(time.perf_counter() - began)}"
        f"{text.DRY if dry_run else ''}"
    )
