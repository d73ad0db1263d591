"""Workflow of all kinds of simulation: read, choose the driving clip, simulate, write, report."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from pathlib import PurePath

import numpy as np

from anim.errors import UnstableError
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.model import Clip, Scene
from anim.operations.selection import Selection
from anim.simulation.report import SimulationReport
from cli import text
from cli.errors import UsageError
from cli.io import documents, scenes
from cli.reports import image_notes
from cli.text import Reporter
from cli.workflows.simulation_report import check_report, commit_report_after, write_report

NO_CLIP = Clip("", ())
Simulate = Callable[[Document, Scene, Clip, int | None], tuple[Document | bytes, SimulationReport, str]]


def simulate_clip(
    input: str,
    output: str,
    clip: str | None,
    simulate: Simulate,
    reporter: Reporter,
    *,
    report: str | None,
    dry_run: bool,
    others: Collection[str] = (),
    uses: Collection[str] = (),
) -> None:
    """Simulate on one clip of a file, write the file and the report, and sum up in one line on stderr.

    clip: glob of the driving clip; the first clip without it. simulate: gets the document, its scene, the driving clip,
    without tracks where the file has none, and its index; returns the document, or the bytes of a file of another
    format, the report, and a summary. The file and the report are both written, or neither. The report of an
    UnstableError is written too, before it is raised again.
    others: file extensions of other formats. uses: glTF extensions that only this simulation supports.
    """
    began = time.perf_counter()
    if output != documents.PIPE and PurePath(output).suffix.lower() in others:
        documents.check_file(output)
    else:
        documents.check_output(output, dry_run=dry_run)
    check_report(report)
    with documents.source(input, reporter, uses=uses) as source:
        scene = scenes.read_scene(source.document, source.name, reporter)
        index = driving_clip(source.document, clip)
        driver = NO_CLIP if index is None else reader.clips(source.document)[index]
        try:
            result, found, summary = simulate(source.document, scene, driver, index)
        except UnstableError as error:
            if report is not None and error.report is not None and not dry_run:
                write_report(error.report, report)
            raise
        note_chosen_clip(source.document, clip, reporter)
        with commit_report_after(found, report, dry_run=dry_run):
            if isinstance(result, bytes):
                size = len(result)
                if not dry_run:
                    documents.write_bytes([np.frombuffer(result, np.uint8)], output)
            else:
                size = documents.write(result, output, source, dry_run=dry_run, reporter=reporter)
    if not dry_run and not isinstance(result, bytes):
        image_notes.report(result, source, output, reporter)
    name = source.name if output == documents.PIPE else output
    took = text.format_duration(time.perf_counter() - began)
    nothing = " (dry run: nothing written)" if dry_run else ""
    reporter.info(f"{name}  {text.format_change(source.size, size)}, {summary}, {took}{nothing}")
    if found.advice:
        reporter.warn(found.advice)


def driving_clip(document: Document, glob: str | None) -> int | None:
    """Return the index of the driving clip; None for a file without clips. Raises UsageError for several."""
    names = reader.names(document)
    if glob is None:
        return 0 if names else None
    chosen = Selection((glob,)).chosen_clips(names)
    if len(chosen) > 1:
        listed = ", ".join(reader.clip_label(names[i], i) for i in chosen[:4])
        more = " …" if len(chosen) > 4 else ""
        raise UsageError(f"--clip '{glob}' names {len(chosen)} clips ({listed}{more}): one drives a simulation")
    return chosen[0]


def note_chosen_clip(document: Document, glob: str | None, reporter: Reporter) -> None:
    """Note which clip drives the simulation, if no glob names one of several."""
    names = reader.names(document)
    if glob is None and len(names) > 1:
        first = reader.clip_label(names[0], 0)
        reporter.info(f"note: {first} drives the simulation, the first of {len(names)} clips (--clip: another)")


def note_own_clip(name: str, driver: Clip, number: int, reporter: Reporter) -> None:
    """Note that the motion is in a clip of its own, which players don't show first. number: index of the driver."""
    first = reader.clip_label(driver.name, number)
    reporter.info(f"note: the motion is clip '{name}'; players begin with another: --merge adds it to {first}")
