"""`gltf-anim inspect`: contents and findings of glTF files."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from dataclasses import asdict, fields
from enum import StrEnum
from functools import partial
from typing import Annotated, Any

import typer

from anim.check.find import group_occurrences
from anim.check.finding import Severity
from anim.check.rules.invalid import RULE as INVALID
from anim.check.rules.invalid import fault_occurrences
from anim.errors import AnimError, FormatError
from anim.measure.inspect.contents import FileContents
from anim.measure.inspect.report import ClipReport, Facts
from anim.operations.selection import Selection
from cli import errors, tables
from cli.errors import CheckError, UsageError
from cli.io import documents, input_files, stdout
from cli.options import common
from cli.reports import inspect_report, json_report
from cli.reports.check_report import count_failures
from cli.reports.inspect_report import Inspected, Smoothness
from cli.text import Reporter
from cli.workflows import checked_files

SCHEMA = 1
CLIP_KEYS = [each.name for each in fields(ClipReport) if each.name != "track_list"]


class Format(StrEnum):
    """Output format."""

    TEXT = "text"
    JSON = "json"
    CSV = "csv"


def command(
    inputs: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="FILE...", help="Files, folders ('.'), or patterns; '-' or none: stdin.", show_default=False
        ),
    ] = None,
    *,
    format: Annotated[Format, typer.Option("--format", help="Text, or one JSON or CSV document.")] = Format.TEXT,
    tracks: Annotated[bool, typer.Option("--tracks", help="List every track.")] = False,
    continuity: Annotated[
        bool, typer.Option("--continuity", help="Classify the keys of every track by continuity: jump, C0, G1, C1, C2.")
    ] = False,
    fail_on: Annotated[
        Severity | None,
        typer.Option("--fail-on", help="Exit 6 if a finding has this severity or a worse one.", show_default=False),
    ] = None,
    html: common.Html = None,
    clip: common.Clips = None,
    quiet: common.Quiet = False,
) -> int:
    """Show the contents of files, with findings and advice.

    Per clip: length, tracks by path (translation/rotation/scale/weights/pointer), keys, estimated frame rate, bytes,
    tracks without effect, redundant keys, loop gap, and speed of the root. Per skin: joints, influences, weights.
    Findings follow, each with advice. Broken files are shown as far as they can be read, with exit code 3; for several
    files the highest code counts. --fail-on turns findings into exit code 6; -q leaves out the text.

    --continuity counts the keys inside each track by what is discontinuous there: the value (jump), the velocity (C0,
    or G1 if its direction is continuous), the acceleration (C1), or nothing of these (C2). It lists the largest change
    of each kind.
    """
    selection = Selection(clip or ())
    done: list[Inspected] = []
    smooth: list[Smoothness] = []
    refused: list[AnimError] = []
    paths = input_files.expand(inputs or [documents.PIPE])
    if html is not None:
        from cli.io.page_output import check_page

        check_page(html, "--html")
        if len(paths) > 1 or paths[0] == documents.PIPE:
            raise UsageError("--html is about one file with a name")
    for path in paths:
        try:
            inspected, tracks_of_clips = _inspected(path, selection, tracks=tracks, continuity=continuity)
        except AnimError as error:
            if len(paths) < 2 and (format is Format.TEXT or not isinstance(error, FormatError)):
                raise checked_files.advise_name(path, error) from None
            inspected, tracks_of_clips = _unreadable(path, error), ()
        done.append(inspected)
        smooth.append(tracks_of_clips)
        refused += [_named(fault, inspected.name) for fault in inspected.facts.faults[:1]]
    if format is Format.JSON:
        try:
            text = _json(done, smooth)
        except FormatError:
            refused += _refuse_infinite(paths, done, smooth)
            text = _json(done, smooth)
        documents.write_text(text)
    elif format is Format.CSV:
        documents.write_text(_csv(done, smooth, tracks=tracks, continuity=continuity))
    elif not quiet:
        for i, inspected in enumerate(done):
            page = inspect_report.page(inspected, smooth[i], tracks=tracks)
            documents.write_text(("\n" if i else "") + page)
    is_shown = format is Format.TEXT and not quiet and stdout.is_read_with_stderr()
    worst = max((errors.report_error(each, is_shown=is_shown) for each in refused), default=errors.DONE)
    if html is not None and worst == errors.DONE:
        _write_page(html, paths[0], done[0], Reporter(quiet))
    if fail_on is not None:
        return max(worst, _check(done, fail_on, is_shown=is_shown))
    return worst


def _write_page(html: str, path: str, inspected: Inspected, reporter: Reporter) -> None:
    from anim.show.page.page import PageContent
    from cli.io.page_files import open_page_file  # imports all readers of caches and curves
    from cli.io.page_output import write_page
    from cli.reports.page_panels import clip_figures, report_panels

    file = open_page_file(path, reporter)
    content = PageContent(panels=report_panels(inspected, file.document), figures=clip_figures(inspected.facts))
    write_page(html, file, None, reporter, content=content)


def _csv(done: list[Inspected], smooth: list[Smoothness], *, tracks: bool, continuity: bool) -> str:
    """CSV of clips or tracks, with a row for the first error of each invalid file."""
    if continuity:
        from cli.reports import continuity_report

        header, rows = continuity_report.rows(done, smooth)
    else:
        header, rows = inspect_report.track_rows(done) if tracks else inspect_report.clip_rows(done)
    filled: list[list[tables.Cell]] = [[*row, ""] for row in rows]
    empty = [""] * (len(header) - 1)
    filled += [[each.name, *empty, str(each.facts.faults[0])] for each in done if each.facts.faults]
    return tables.comma_separated([*header, "error"], filled)


def _named(fault: AnimError, name: str) -> AnimError:
    return copy(fault).at(name, ": ")


def _check(done: list[Inspected], limit: Severity, *, is_shown: bool) -> int:
    """Report an error if a finding has severity `limit` or higher; the exit code."""
    bad = [
        (each.name, finding)
        for each in done
        for finding in each.findings
        if finding.code != INVALID.code and finding.severity.is_at_least(limit)
    ]
    if bad:
        name, first = bad[0]
        more = count_failures([path for path, _ in bad])
        error = CheckError(f"{name}: {first.severity} {first.name}: {first.where}: {first.problem}{more}")
        return errors.report_error(error, is_shown=is_shown and first.severity is Severity.ERROR)
    return errors.DONE


def _inspected(path: str, selection: Selection, *, tracks: bool, continuity: bool) -> tuple[Inspected, Smoothness]:
    with checked_files.open_checked(path, selection, tracks=tracks) as (source, file):
        smooth = _smooth(file.contents, file.facts) if continuity else ()
        groups = group_occurrences(file)
        findings = tuple(finding for finding, _ in groups)
        found = tuple(occurrences for _, occurrences in groups)
        return Inspected(source.name, source.size, file.facts, findings, found), smooth


def _unreadable(path: str, error: AnimError) -> Inspected:
    """Report of a file that can't be read at all."""
    fault = checked_files.fault_of(path, error)
    findings = [INVALID.finding([each], (), INVALID.severity) for each in fault_occurrences([fault])]
    return Inspected(documents.called(path), 0, checked_files.facts_of_unreadable(fault), tuple(findings))


def _smooth(contents: FileContents, facts: Facts) -> Smoothness:
    from anim.measure.continuity.continuity import continuity

    return tuple(continuity(contents.clips[each.index], contents.skeleton) for each in facts.clips)


def _json(done: list[Inspected], smooth: list[Smoothness]) -> str:
    return json_report.dump({"schema": SCHEMA, "files": [*map(_entry, done, smooth)]})


def _entry(inspected: Inspected, smooth: Smoothness) -> dict[str, Any]:
    """Entry of a file in the JSON."""
    entry = {"file": inspected.name, "bytes": inspected.file_bytes, **_plain(inspected)}
    if smooth:
        from cli.reports import continuity_report

        entry["clips"] = [
            {**_plain_clip(clip), "continuity": [continuity_report.json(track) for track in tracks]}
            for clip, tracks in zip(inspected.facts.clips, smooth, strict=True)
        ]
    return entry


def _refuse_infinite(paths: list[str], done: list[Inspected], smooth: list[Smoothness]) -> Iterator[AnimError]:
    """Replace reports that JSON can't hold by those of unreadable files: the others' are kept. Yield the errors."""
    for i, path in enumerate(paths):
        try:
            json_report.check_finite(_entry(done[i], smooth[i]))
        except FormatError as error:
            name = done[i].name
            done[i], smooth[i] = _unreadable(path, error), ()
            yield _named(error, name)


def _plain(inspected: Inspected) -> dict[str, Any]:
    """Report as JSON values: tracks only if requested, and the first error as text."""
    facts = inspected.facts._asdict()
    faults = facts.pop("faults")
    facts["clips"] = [partial(_plain_clip, each) for each in inspected.facts.clips]
    facts["skins"] = [asdict(each) for each in inspected.facts.skins]
    facts["findings"] = [each._asdict() for each in inspected.findings]
    facts["error"] = str(faults[0]) if faults else None
    return facts


def _plain_clip(report: ClipReport) -> dict[str, Any]:
    values = {key: getattr(report, key) for key in CLIP_KEYS}
    listed = [track._asdict() for track in report.track_list]
    return {**values, "track_list": listed} if listed else values
