"""Optimization of one file: repeated searches at several bounds, and sizes as written."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

from anim.gltf.document import Document
from anim.measure.inspect.storage_cost import animation_bytes
from anim.model import Clip, Scene
from anim.optimization.clip_optimizer import ClipResult
from anim.optimization.optimize import Optimized, find_results, optimize
from anim.optimization.options import Request
from anim.optimization.rate_distortion import RatePoint

MIN_PARALLEL_KEYS = 60_000  # keys times tracks; above, worker processes save more time than they cost
FAST = "fast"  # effort of sizes that are only compared

Progress: TypeAlias = Callable[[], AbstractContextManager[Callable[[float], None]]]


@dataclass(frozen=True, eq=False)
class FileOptimizer:
    """A file, its clips, and how they are optimized.

    document, scene, clips: of the file. chosen: indices of the clips to optimize. scale: m, the diagonal of the scene.
    written_size: of a document, in bytes. workers: processes for a search of many keys. start: start method of
    `multiprocessing`. detailed: whether verifications include statistics. progress: opens the display of a search, a
    function of the fraction done.
    """

    document: Document
    scene: Scene
    clips: tuple[Clip, ...]
    chosen: Sequence[int]
    scale: float
    written_size: Callable[[Document], int]
    workers: int = 1
    start: str = "spawn"
    detailed: bool = False
    progress: Progress = lambda: nullcontext(lambda _: None)

    def run(
        self, request: Request, *, verified: bool = True, earlier: Mapping[int, ClipResult] | None = None
    ) -> Optimized:
        """Return the document with the result of the search. earlier: results of clips that are not searched again."""
        searched = [i for i in self.chosen if i not in (earlier or {})]
        with self.progress() as progress:
            return optimize(
                self.document,
                self.scene,
                self.clips,
                request,
                chosen=self.chosen,
                workers=self._num_workers(searched),
                start=self.start,
                detailed=self.detailed and verified,
                verified=verified,
                earlier=earlier,
                progress=progress,
            )

    def search(self, request: Request, chosen: Sequence[int], *, verified: bool = True) -> dict[int, ClipResult]:
        """Return the results of some clips."""
        with self.progress() as progress:
            return find_results(
                self.document,
                self.scene,
                self.clips,
                request,
                chosen=chosen,
                workers=self._num_workers(chosen),
                start=self.start,
                detailed=self.detailed and verified,
                verified=verified,
                progress=progress,
            )

    def _num_workers(self, searched: Sequence[int]) -> int:
        """Several processes if they are faster than one."""
        num_keys = sum(track.values.size for i in searched for track in self.clips[i].tracks)
        return self.workers if len(searched) > 1 and num_keys > MIN_PARALLEL_KEYS else 1

    def choose_document(self, found: Optimized) -> tuple[Document, int]:
        """Return the optimized document, or the source if that takes no more bytes, with its size in bytes."""
        size = self.written_size(found.document)
        if found.unchanged or size >= self._source_size:
            return self.document, self._source_size
        return found.document, size

    @cached_property
    def _source_size(self) -> int:
        return self.written_size(self.document)

    def measure_point(self, max_error: float, found: Optimized) -> RatePoint:
        """Return the rate-distortion point of a result within a bound, in m."""
        document, size = self.choose_document(found)
        error = 0.0 if document is self.document else found.max_error  # the source moves no vertex
        return RatePoint(max_error, size, error, animation_bytes(document))

    def find_point(self, request: Request, max_error: float) -> RatePoint:
        """Return the rate-distortion point of a bound, in m."""
        return self.measure_point(max_error, self.run(request.with_bound(max_error)))
