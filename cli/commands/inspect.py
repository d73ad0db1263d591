"""`gltf-anim inspect`: what is in these files, and are they healthy?"""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from enum import StrEnum
from typing import Annotated, Any

import typer

from anim.errors import AnimError
from anim.gltf import read
from anim.gltf.document import Document
from anim.measure.facts import Facts
from anim.measure.findings import Finding, Severity
from anim.measure.inspect import inspect as facts_of
from anim.ops.selection import Selection
from cli import errors, inspection, options, streams, tables
from cli.errors import CheckError
from cli.inspected import Inspected, Smoothness

SCHEMA = 1
LOST = "put it there, or mend the URI"


class Format(StrEnum):
    """What the product looks like."""

    TEXT = "text"
    JSON = "json"
    CSV = "csv"


def inspect(
    inputs: Annotated[
        list[str] | None, typer.Argument(metavar="FILE", help="Files, '-' for stdin.", show_default=False)
    ] = None,
    *,
    format: Annotated[
        Format, typer.Option("--format", help="Text to read, or one JSON or CSV document.")
    ] = Format.TEXT,
    tracks: Annotated[bool, typer.Option("--tracks", help="List every track, not only clips.")] = False,
    continuity: Annotated[
        bool, typer.Option("--continuity", help="Say how smooth every track is at its keys: jumps, C0, G1, C1, C2.")
    ] = False,
    fail_on: Annotated[
        Severity | None,
        typer.Option("--fail-on", help="Exit 6 where a finding is this bad or worse.", show_default=False),
    ] = None,
    clip: options.Clips = None,
    quiet: options.Quiet = False,
) -> int:
    """Show what is in a file and whether it is healthy.

    Per clip: length, tracks by path (translation/rotation/scale/weights/pointer), keys, estimated frame rate, bytes,
    tracks that do nothing, keys that say nothing, the seam of a loop, the speed of the root. Per skin: joints,
    influences, weights. Below: findings, with what to do. With several files a bad one is reported and the others go
    on; the exit code is the worst. --fail-on makes it a gate.

    --continuity counts, per track, the keys between its ends by what jumps there: the value (jump), the speed (C0, or
    G1 where the direction goes on), the acceleration (C1), or nothing (C2), and names the largest jump of each.
    """
    del quiet
    selection = Selection(clip or ())
    worst = 0
    done: list[Inspected] = []
    smooth: list[Smoothness] = []
    for path in inputs or [streams.PIPE]:
        try:
            inspected, tracks_of_clips = _inspected(path, selection, tracks=tracks, continuity=continuity)
            done.append(inspected)
            smooth.append(tracks_of_clips)
        except AnimError as error:
            if len(inputs or ()) < 2:
                raise
            worst = max(worst, errors.reported(error))
    if format is Format.JSON:
        streams.write_text(_json(done, smooth))
    elif format is Format.CSV:
        if continuity:
            from cli import smoothness

            header, rows = smoothness.rows(done, smooth)
        else:
            header, rows = inspection.track_rows(done) if tracks else inspection.clip_rows(done)
        streams.write_text(tables.comma_separated(header, rows))
    else:
        for i, (name, size, facts) in enumerate(done):
            page = inspection.page(name, size, facts, smooth[i], tracks=tracks)
            streams.write_text(("\n" if i else "") + page)
    if fail_on is not None:
        _check(done, fail_on)
    return worst


def _check(done: list[Inspected], limit: Severity) -> None:
    """Raise CheckError where a finding is as bad as `limit`, or worse."""
    order = list(Severity)  # the worst first
    bad = [
        (name, each)
        for name, _, facts in done
        for each in facts.findings
        if order.index(each.severity) <= order.index(limit)
    ]
    if bad:
        name, first = bad[0]
        more = f" and {len(bad) - 1} more" if len(bad) > 1 else ""
        raise CheckError(f"{name}: {first.severity} {first.name}: {first.where}: {first.problem}{more}")


def _inspected(path: str, selection: Selection, *, tracks: bool, continuity: bool) -> tuple[Inspected, Smoothness]:
    with streams.source(path) as source:
        chosen = selection.chosen_clips(read.names(source.document)) if selection.clips else None
        facts = facts_of(source.document, file_bytes=source.size, chosen=chosen, tracks=tracks)
        lost = (
            Finding("missing-file", Severity.WARNING, *each, LOST)
            for each in streams.missing(source.document, source.folder)
        )
        facts = replace(facts, findings=(*facts.findings, *lost))
        smooth = _smooth(source.document, facts) if continuity else ()
        return (source.name, source.size, facts), smooth


def _smooth(document: Document, facts: Facts) -> Smoothness:
    from anim.measure.continuity import continuity

    clips, skeleton = read.clips(document), read.skeleton(document)
    return tuple(continuity(clips[each.index], skeleton) for each in facts.clips)


def _json(done: list[Inspected], smooth: list[Smoothness]) -> str:
    files = [{"file": name, "bytes": size, **_plain(asdict(facts))} for name, size, facts in done]
    if any(smooth):
        _add_smoothness(files, smooth)
    return json.dumps({"schema": SCHEMA, "files": files}, allow_nan=False, ensure_ascii=False, indent=1) + "\n"


def _add_smoothness(files: list[dict[str, Any]], smooth: list[Smoothness]) -> None:
    from cli import smoothness

    for file, of_clips in zip(files, smooth, strict=True):
        for clip, tracks in zip(file["clips"], of_clips, strict=False):
            clip["continuity"] = [smoothness.json(track) for track in tracks]


def _plain(facts: dict[str, Any]) -> dict[str, Any]:
    """Facts as JSON holds them: a list of tracks only where one was asked for."""
    for clip in facts["clips"]:
        listed = clip.pop("track_list")
        if listed:
            clip["track_list"] = listed
    return facts
