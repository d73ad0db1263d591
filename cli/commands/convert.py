"""`gltf-anim convert`: the other container, and nothing else."""

from __future__ import annotations

import time
from typing import Annotated

import typer

from cli import options, report, streams


def convert(
    input: options.Input = "-",
    output: options.Output = "-",
    *,
    embed: Annotated[bool, typer.Option("--embed", help="Take external images into the file too.")] = False,
    dry_run: options.DryRun = False,
    quiet: options.Quiet = False,
) -> None:
    """Change between .glb and .gltf, and nothing else.

    A .glb holds buffer 0 in its binary chunk, further buffers as data URIs; a .gltf writes its .bin beside it. The rest
    of the JSON stays as it is: numbers, order, extras, unknown extensions.
    """
    voice = report.Voice(quiet)
    began = time.perf_counter()
    if not dry_run:
        streams.check_output(output)
    with streams.source(input) as source:
        document = source.document
        if embed:
            document = streams.with_images(document, source.folder)
        size = streams.write(document, output, source.folder, dry_run=dry_run)
    outside = streams.left_outside(document, source.folder, output)
    if outside:
        voice.say(f"{outside}; --embed takes them in")
    name = source.name if output == streams.PIPE else output
    voice.say(f"{name}  {report.change(source.size, size)}, {time.perf_counter() - began:.1f} s")
