"""glTF → skinned USD: a file for a clip, or one for each with {clip} in its name."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from anim.caches.source_document.bake_source import self_contained
from anim.caches.temporary_files import temporary_folder
from anim.errors import not_written
from anim.exchange.usd_skel.write import UsdSkelResult, write
from anim.gltf.document import Document
from anim.gltf.io.source import Source
from anim.gltf.reading import reader
from anim.measure.error.surface import diagonal
from anim.model import Clip, Scene
from anim.operations.selection import Selection
from anim.units import plural
from cli import text
from cli.errors import UsageError
from cli.io import cache_folders, documents, scenes
from cli.io.output_folders import make_folder
from cli.reports.bake_notes import VISIBLE_ERROR_PER_DIAGONAL
from cli.text import Reporter
from cli.workflows.bake_jobs import bake_jobs


def convert_to_usd(
    input: str,
    output: str,
    *,
    clips: Sequence[str] | None,
    fps: float | None,
    max_files: int | None,
    dry_run: bool,
    reporter: Reporter,
) -> None:
    """Write the document at `input` as USD, with one of its clips or a file for each."""
    if not dry_run:
        documents.check_file(output, ("clip",))
    with documents.source(input, reporter) as source:
        found = reader.clips(source.document)
        chosen = Selection(clips or ()).chosen_clips(reader.names(source.document))
        _check_one_clip(output, [(found[i].name, i) for i in chosen])
        scene = scenes.read_scene(source.document, source.name, reporter, normals=True)
        scenes.warn_of_other_scenes(source.document, source.name, reporter, None)
        ending = Path(output).suffix.lower()
        meshes = {source.document.json["nodes"][each.node]["mesh"] for each in scene.instances}
        document = self_contained(source.document, source, meshes)
        jobs = bake_jobs(output, ending, [("", None)], [(found[i].name, i) for i in chosen], max_files)
        for job in jobs:
            played = Clip("", ()) if job.clip is None else found[job.clip]
            label = "" if job.clip is None else reader.clip_label(played.name, job.clip)
            with make_folder(job.file, needed=job.makes_folder and not dry_run):
                _convert((source, document, scene), played, job.file, fps, label, reporter, dry_run=dry_run)


def _check_one_clip(output: str, clips: Sequence[tuple[str, int]]) -> None:
    if len(clips) > 1 and "{clip}" not in output:
        raise UsageError(
            f"{len(clips)} clips are chosen, but USD holds one",
            help="choose one with --clip, or put {clip} into OUT for a file per clip",
        )


def _convert(
    read: tuple[Source, Document, Scene],
    clip: Clip,
    path: str,
    fps: float | None,
    label: str,
    reporter: Reporter,
    *,
    dry_run: bool,
) -> None:
    began = time.perf_counter()
    source, document, scene = read
    with temporary_folder() as away:
        staged = cache_folders.outputs(path, away, dry_run=dry_run)
        try:
            written = write(document, scene, clip, staged, ending=Path(path).suffix.lower(), fps=fps)
            size = staged.size(staged.names)
            if not dry_run:
                staged.commit()
        except OSError as error:
            raise not_written(path, error) from None
        finally:
            staged.clear()
    for note in written.notes:
        reporter.info(f"note: {note}")
    _note_error(written, scene, label, reporter)
    parts = [f"{path}  {text.format_change(source.size, size)}"]
    if label:
        frames = plural(written.frames, "frame")
        parts.append(f"{label}, {frames} at {written.fps:g} fps, max {text.format_length(written.error.distance)}")
    parts.append(text.format_duration(time.perf_counter() - began))
    reporter.info(", ".join(parts) + (" (dry run: nothing written)" if dry_run else ""))


def _note_error(written: UsdSkelResult, scene: Scene, label: str, reporter: Reporter) -> None:
    """Note an error that can be seen."""
    size = diagonal(scene)
    distance, time_s = written.error
    if distance > VISIBLE_ERROR_PER_DIAGONAL * size:
        reporter.info(
            f"note: a vertex is {text.format_length(distance)}{text.format_fraction(distance, size)} from the source "
            f"at {text.format_instant(time_s)}{f' of {label}' if label else ''} (reduce with a higher --fps)"
        )
