"""`gltf-anim inspect`: what is in these files, and are they healthy?"""

from __future__ import annotations

import json
from dataclasses import asdict
from enum import StrEnum
from typing import Annotated, Any

import typer

from anim.errors import AnimError
from anim.gltf import read
from anim.measure.inspect import Facts
from anim.measure.inspect import inspect as facts_of
from anim.ops.selection import Selection
from cli import errors, inspection, options, streams, tables

SCHEMA = 1


class Format(StrEnum):
    """What the product looks like."""

    TEXT = "text"
    JSON = "json"
    CSV = "csv"


def inspect(
    inputs: Annotated[
        list[str] | None, typer.Argument(metavar="[FILE]...", help="Files, '-' for stdin.", show_default=False)
    ] = None,
    *,
    format: Annotated[
        Format, typer.Option("--format", help="Text to read, or one JSON or CSV document.")
    ] = Format.TEXT,
    tracks: Annotated[bool, typer.Option("--tracks", help="List every track, not only clips.")] = False,
    clip: options.Clips = None,
    quiet: options.Quiet = False,
) -> int:
    """Show what is in a file and whether it is healthy.

    Per clip: length, tracks by path (translation/rotation/scale/weights/pointer), keys, estimated frame rate, bytes,
    tracks that do nothing, keys that say nothing, the seam of a loop, the speed of the root. Per skin: joints,
    influences, weights. Below: findings, with what to do. With several files a bad one is reported and the others go
    on; the exit code is the worst.
    """
    del quiet
    selection = Selection(clip or ())
    worst = 0
    done: list[tuple[str, int, Facts]] = []
    for path in inputs or [streams.PIPE]:
        try:
            done.append(_inspected(path, selection, tracks=tracks))
        except AnimError as error:
            if len(inputs or ()) < 2:
                raise
            worst = max(worst, errors.reported(error))
    if format is Format.JSON:
        streams.write_text(_json(done))
    elif format is Format.CSV:
        header, rows = inspection.track_rows(done) if tracks else inspection.clip_rows(done)
        streams.write_text(tables.comma_separated(header, rows))
    else:
        for i, (name, size, facts) in enumerate(done):
            streams.write_text(("\n" if i else "") + inspection.page(name, size, facts, tracks=tracks))
    return worst


def _inspected(path: str, selection: Selection, *, tracks: bool) -> tuple[str, int, Facts]:
    with streams.source(path) as source:
        chosen = selection.chosen_clips(read.names(source.document)) if selection.clips else None
        facts = facts_of(source.document, file_bytes=source.size, chosen=chosen, tracks=tracks)
        return source.name, source.size, facts


def _json(done: list[tuple[str, int, Facts]]) -> str:
    files = [{"file": name, "bytes": size, **_plain(asdict(facts))} for name, size, facts in done]
    return json.dumps({"schema": SCHEMA, "files": files}, allow_nan=False, ensure_ascii=False, indent=1) + "\n"


def _plain(facts: dict[str, Any]) -> dict[str, Any]:
    """Facts as JSON holds them: a list of tracks only where one was asked for."""
    for clip in facts["clips"]:
        listed = clip.pop("track_list")
        if listed:
            clip["track_list"] = listed
    return facts
