"""`gltf-anim convert`: .glb ↔ .gltf."""

from __future__ import annotations

import time
from typing import Annotated

import typer

from anim.gltf.io import images
from anim.gltf.io.source import external_files
from cli import text
from cli.io import documents
from cli.options import common
from cli.reports import image_notes
from cli.streams import record_files


def command(
    input: common.Input = "-",
    output: common.Output = "-",
    *,
    embed: Annotated[bool, typer.Option("--embed", help="Embed external images, if their files exist.")] = False,
    dry_run: common.DryRun = False,
    quiet: common.Quiet = False,
) -> None:
    """Convert between .glb and .gltf; nothing else changes.

    A .glb contains buffer 0 in its binary chunk, and further buffers as data URIs. A .gltf has a companion .bin file.
    The rest of the JSON stays: numbers, order, extras, unknown extensions. If the output is in another folder, external
    images are copied beside it.
    """
    voice = text.Reporter(quiet)
    began = time.perf_counter()
    if not dry_run:
        documents.check_output(output)
    with documents.source(input, voice) as source:
        document = source.document
        if embed:
            record_files(*external_files(source))
            document = images.embed(document, source.folder)
        size = documents.write(document, output, source, dry_run=dry_run, voice=voice)
    if not dry_run and (embed or output == documents.PIPE or not source.is_in_folder(output)):
        copied = output != documents.PIPE
        for note in image_notes.notes(document, source.folder, copied=copied, embed_hint="--embed takes them in"):
            voice.info(note)
    name = source.name if output == documents.PIPE else output
    voice.info(f"{name}  {text.format_change(source.size, size)}, {text.format_duration(time.perf_counter() - began)}")
