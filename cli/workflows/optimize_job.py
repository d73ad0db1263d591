"""Optimization of one file: repeated searches, and sizes as written."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property

from anim.files import signals
from anim.gltf.document import Document
from anim.gltf.io.source import Source
from anim.gltf.reading import reader
from anim.gltf.reading.accessors import Accessors
from anim.measure.error.surface import diagonal
from anim.model import Clip, Scene
from anim.operations.selection import Selection
from anim.optimization.clip_optimizer import ClipResult
from anim.optimization.optimize import Optimized, find_results, optimize
from anim.optimization.options import Bounds, Request
from anim.optimization.rate_distortion import RatePoint
from anim.units import is_zero
from cli import units
from cli.io import documents, scenes
from cli.progress import Progress
from cli.reports import optimize_report
from cli.streams import step_streams
from cli.text import Reporter

START = "fork" if sys.platform == "linux" else "spawn"  # start method of worker processes
FAST = "fast"  # effort of sizes that are only compared
DEFAULT_MAX_ERROR = "0.01%"  # of the diagonal


@dataclass(frozen=True)
class OptimizeJob:
    """A file, its selected clips, and its output.

    chosen: indices of clips. scale: m, the diagonal. detailed: whether verdicts include statistics.
    """

    source: Source
    clips: tuple[Clip, ...]
    scene: Scene
    chosen: Sequence[int]
    scale: float
    output: str
    workers: int
    detailed: bool
    progress: Progress

    def run(
        self, request: Request, *, verified: bool = True, earlier: Mapping[int, ClipResult] | None = None
    ) -> Optimized:
        """Return the document with the result of the search. earlier: results of clips that are not searched again."""
        searched = [i for i in self.chosen if i not in (earlier or {})]
        with self._progress_shown() as progress:
            return optimize(
                self.source.document,
                self.scene,
                self.clips,
                request,
                chosen=self.chosen,
                workers=self._num_workers(searched),
                start=START,
                detailed=self.detailed and verified,
                verified=verified,
                earlier=earlier,
                progress=progress,
            )

    def search(self, request: Request, chosen: Sequence[int], *, verified: bool = True) -> dict[int, ClipResult]:
        """Return the results of some clips."""
        with self._progress_shown() as progress:
            return find_results(
                self.source.document,
                self.scene,
                self.clips,
                request,
                chosen=chosen,
                workers=self._num_workers(chosen),
                start=START,
                detailed=self.detailed and verified,
                verified=verified,
                progress=progress,
            )

    def _num_workers(self, searched: Sequence[int]) -> int:
        return self.workers if optimize_report.is_long(self.clips, searched) else 1

    @contextmanager
    def _progress_shown(self) -> Iterator[Callable[[float], None]]:
        """Provide a function that shows the fraction done."""
        with signals.ignore_broken_pipes():
            yield lambda fraction: self.progress(round(1000 * fraction))
        self.progress.close()

    def result(self, found: Optimized) -> tuple[Document, int]:
        """Return the optimized document, or the source if that takes no more bytes, with its size in bytes."""
        size = self.size(found.document)
        if found.unchanged or size >= self._source_size:
            return self.source.document, self._source_size
        return found.document, size

    def size(self, document: Document) -> int:
        """Return the size in bytes of a document as written."""
        return documents.write(document, self.output, self.source, dry_run=True)

    @cached_property
    def _source_size(self) -> int:
        return self.size(self.source.document)

    def point(self, max_error: float, found: Optimized) -> RatePoint:
        """Return the rate-distortion point of a result within a bound, in m."""
        document, size = self.result(found)
        error = 0.0 if document is self.source.document else optimize_report.worst(found)  # the source moves no vertex
        return RatePoint(max_error, size, error, optimize_report.cost(document))

    def sized(self, request: Request, max_error: float) -> RatePoint:
        """Return the rate-distortion point of a bound, in m, by a fast search."""
        return self.point(max_error, self.run(replace(with_bound(request, max_error), effort=FAST)))


def with_bound(request: Request, max_error: float) -> Request:
    """Return the request with a computed bound in metres."""
    return replace(request, bounds=replace(request.bounds, max_error=max_error), given=())


def optimize_job(
    source: Source, output: str, *, clip: Sequence[str], workers: int, detailed: bool, reporter: Reporter
) -> OptimizeJob:
    """Return the job for a source. clip: globs. workers: processes, 0 for one per core.

    Raises NotFoundError; FormatError or UnsupportedError if vertices can't be read, since no bound can be verified.
    """
    document = source.document
    accessors = Accessors(document)
    clips = tuple(reader.clips(document, accessors))
    scene = scenes.read_scene(document, source.name, reporter, accessors=accessors, repeats=False)
    return OptimizeJob(
        source,
        clips,
        scene,
        Selection(clip).chosen_clips(reader.names(document)),
        diagonal(scene),
        output,
        workers or _cores(),
        detailed,
        Progress("optimize", 1000, shown=not reporter.quiet),
    )


def _cores() -> int:
    step = step_streams()
    return (0 if step is None else step.cores) or os.cpu_count() or 1


def bounds(scene: Scene, said: Mapping[str, str | None]) -> Bounds:
    """Return the bounds in metres and radians; percents are of the scene's diagonal. Raises UsageError.

    said: option texts by the names of the bounds; None for options not given.
    """
    scale = diagonal(scene)

    def length(name: str) -> float | None:
        text, option = said[name], f"--{name.replace('_', '-')}"
        if text is None:
            return None
        return 0.0 if is_zero(text) else units.parse_length(text, option, lambda: scale)

    pointer, angle, speed = said["max_pointer_error"] or "0", said["max_angle"], said["max_speed_error"]
    return Bounds(
        length("max_error") or 0.0,
        length("shell") or 0.0,
        0.0 if is_zero(pointer) else units.parse_fraction(pointer, "--max-pointer-error"),
        None if angle is None else units.parse_angle(angle, "--max-angle"),
        None if speed is None else units.parse_length(speed, "--max-speed-error", lambda: scale),
    )


def raw_options(bounds: Bounds, said: Mapping[str, str | None]) -> tuple[str, ...]:
    """Return bounds as typed if they are fractions of the diagonal, else in metres."""
    return tuple(_fraction(text) or f"{getattr(bounds, name)}" for name, text in said.items())


def notes(said: Mapping[str, str | None]) -> Iterator[str]:
    """Yield notes on lengths without a unit, which are metres."""
    for name in ("max_error", "shell"):
        text = (said[name] or "").strip()
        if text and text[-1].isdigit() and not is_zero(text):
            yield f"--{name.replace('_', '-')} {text} means {text} m, for want of a unit (0.5mm, 0.1%)"


def _fraction(text: str | None) -> str:
    number = (text or "").strip()
    return f"{float(number[:-1])}%" if number.endswith("%") else ""


def nodes_to_keep(globs: Sequence[str], scene: Scene) -> frozenset[int]:
    """Return the indices of the nodes that match any glob; none without globs. Raises NotFoundError."""
    return frozenset(Selection((), globs).chosen_nodes(scene.skeleton)) if globs else frozenset()


def count_of_bytes(text: str) -> int:
    """Return a number of bytes above 0: 800kB, 1.5 MB, 65536. Raises UsageError."""
    return units.parse_size(text, "--max-bytes")
