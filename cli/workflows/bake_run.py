"""The bakes of one command, a file each, and what its notes report on all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

from anim.caches.transforms import statistics, up_axis, vertex_order
from anim.errors import FormatError, RangeError, UnsupportedError
from anim.gltf.io.source import Source
from anim.gltf.reading import reader
from anim.model import Clip, Scene, VertexCache
from anim.skinning.analysis.inbetween_error import InbetweenError, InbetweenMetric
from anim.skinning.analysis.method_deviation import Deviation, MeasuredBake, linear_baker
from anim.skinning.uneven import UnevenScale
from cli import units
from cli.errors import UsageError
from cli.io import cache_files
from cli.io.cache_files import CommitWith, SavedCache, commit_alone
from cli.io.cache_folders import StagedFolder
from cli.io.output_folders import make_folder
from cli.options import caches
from cli.progress import Progress
from cli.reports import bake_notes
from cli.reports.bake_report import BakedFile, report_written
from cli.text import Reporter
from cli.workflows.bake_clip import BakeOptions, Output, keeps_nodes
from cli.workflows.bake_jobs import BakeJob
from cli.workflows.bake_source_options import BakeSources

LINEAR = "lbs"  # blending as in every player, which other methods are compared with


@dataclass(frozen=True, slots=True)
class FileOptions:
    """Options of the files. values: those of one format. max_error: a length, or % of the size."""

    ending: str
    values: Mapping[str, Any]
    max_error: str | None
    up: str | None
    vertex_order: str | None
    keep_skeleton: bool
    dry_run: bool

    def check(self, *, normals: bool, tangents: bool) -> None:
        """Raise UsageError before any work for options that the format doesn't support."""
        caches.write_options(self.ending, {**self.values, "max_error": self.max_error})
        caches.check_supported(self.ending, normals=normals, tangents=tangents)
        if self.keep_skeleton and not keeps_nodes(self.ending):
            raise UsageError(f"--keep-skeleton does not apply to {self.ending}")

    def transform(self, cache: VertexCache) -> VertexCache:
        """Return a cache with the vertex order and the up axis of the options."""
        if self.vertex_order is not None:
            cache = vertex_order.reorder(cache, str(self.vertex_order))
        return cache if self.up is None else up_axis.to_up_axis(cache, str(self.up))

    def save(self, cache: VertexCache, file: str, source: Mapping[str, Any], commit_with: CommitWith) -> SavedCache:
        """Write a cache, and other outputs as `cache_files.save`. source: the option of formats that keep materials."""
        error = None
        if self.max_error is not None:
            error = units.parse_length(self.max_error, "--max-error", lambda: statistics.diagonal(cache))
        options = caches.write_options(self.ending, {**self.values, "max_error": error, **source})
        return cache_files.save(cache, file, options, ending=self.ending, dry_run=self.dry_run, commit_with=commit_with)


class GroupBaker:
    """Bakes clips of the meshes of a group, with what the notes need of them."""

    def __init__(self, scene: Scene, nodes: Sequence[int] | None, options: BakeOptions, sources: BakeSources) -> None:
        self.sources = sources
        self.baker = options.baker(scene, nodes)
        self.inbetween = InbetweenMetric(self.baker)
        is_linear = options.method == LINEAR
        self.linear = None if is_linear else linear_baker(self.baker, space=options.space)
        self.scales = None if is_linear else UnevenScale(self.baker)


class BakeRun:
    """Bakes clips into files one after another, and collects findings for the notes.

    commit_with: makes other outputs of the files.
    """

    def __init__(
        self,
        source: Source,
        scene: Scene,
        options: BakeOptions,
        file_options: FileOptions,
        reporter: Reporter,
        commit_with: CommitWith = commit_alone,
    ) -> None:
        self.files: list[BakedFile] = []
        self._source, self._scene, self._options = source, scene, options
        self._file_options, self._reporter, self._commit_with = file_options, reporter, commit_with
        self._group: tuple[int, GroupBaker] | None = None
        self._inbetween: dict[tuple[int, int], InbetweenError] = {}  # by group and first equal clip
        self._inbetween_errors: list[tuple[str, InbetweenError]] = []
        self._deviations: list[tuple[str, Deviation]] = []
        self._uneven_joints: set[int] = set()

    def bake(self, job: BakeJob, nodes: Sequence[int] | None, clip: Clip, *, first: int = -1) -> None:
        """Bake a clip into a file. nodes: of the meshes in the job's group, None for all.

        first: number of the first job with an equal clip, whose errors are those of this one; −1 if unknown.
        An error names the clip, and the files that were written before.
        """
        try:
            self._bake(job, nodes, clip, first)
        except BaseException as error:
            if job.clip is not None and isinstance(error, (FormatError, UnsupportedError, RangeError)):
                error.at(reader.clip_label(clip.name, job.clip))
            report_written(self.files, self._reporter, dry_run=self._file_options.dry_run)
            raise

    def _bake(self, job: BakeJob, nodes: Sequence[int] | None, clip: Clip, first: int) -> None:
        group = self._baker(job.group, nodes)
        times, label = self._options.times(clip), reader.clip_label(clip.name, job.clip or 0)
        if group.scales is not None:
            self._uneven_joints.update(group.scales.joints(clip, times))
        known = self._inbetween.get((job.group, first)) if first >= 0 else None
        found = group.inbetween.largest_error(clip, times) if known is None else known
        self._inbetween[job.group, first] = found
        self._inbetween_errors.append((label, found))
        progress = Progress(PurePath(job.file).name, len(times), shown=not self._reporter.quiet)
        measured = None
        if group.linear is not None:
            measured = MeasuredBake(group.baker, group.linear, clip, times, progress)
        baked = group.baker.bake(clip, times=times, progress=progress) if measured is None else measured.cache
        cache = self._file_options.transform(baked)
        output = Output(job.file, self._file_options.ending, self._file_options.dry_run)
        source = group.sources.option(job.clip, clip, output)

        def commit_with(staged: StagedFolder) -> AbstractContextManager[None]:
            progress.close()  # whose bar is not for this
            return self._commit_with(staged)

        try:
            with make_folder(job.file, needed=job.makes_folder and not self._file_options.dry_run):
                saved = self._file_options.save(cache, job.file, source, commit_with)
        finally:
            progress.close()
        if measured is not None:
            self._deviations.append((label, measured.deviation()))
        self.files.append(BakedFile(job.file, clip.name, job.clip, job.group, len(times), cache.vertex_count, saved))

    def report_findings(self) -> None:
        """Report errors between frames, and where the method is unsuited or differs between tools."""
        assert self._group is not None
        rest, method = self._group[1].baker.rest, self._options.method
        is_chosen = self._options.fps is not None
        bake_notes.frame_gap_note(self._inbetween_errors, rest, self._reporter, is_chosen=is_chosen)
        bake_notes.lost_data_notes(self._deviations, method, self._reporter)
        bake_notes.uneven_scale_note(sorted(self._uneven_joints), self._scene, method, self._reporter)

    def _baker(self, index: int, nodes: Sequence[int] | None) -> GroupBaker:
        """Return the baker of a group; that of one group at a time is in memory."""
        if self._group is None or self._group[0] != index:
            keep_skeleton = self._file_options.keep_skeleton
            sources = BakeSources(self._source, self._scene, nodes, self._options, keep_skeleton=keep_skeleton)
            self._group = index, GroupBaker(self._scene, nodes, self._options, sources)
        return self._group[1]
