"""Optimization of a document's animations: fewer bytes, within error bounds measured on the result."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from anim.errors import AnimError
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.gltf.reading.node_constraints import constraint_sources
from anim.measure.equal_clips import first_equal
from anim.measure.error.sample_times import FPS
from anim.measure.error.surface import has_vertices
from anim.model import Clip, Scene
from anim.optimization import writing
from anim.optimization.clip import Task
from anim.optimization.clip_batches import batch_clips
from anim.optimization.clip_optimizer import ClipOptimizer, ClipResult, VerificationRequest
from anim.optimization.optimize_clips import optimize_clips
from anim.optimization.options import Request
from anim.optimization.process_pool import process_pool
from anim.optimization.rest_pose import RebasedDocument, rebase
from anim.optimization.search.plan import Solution
from anim.optimization.shared_constants import find_constants
from anim.optimization.tracks.quantization import BYTE_COSTS, Encoding
from anim.optimization.verification import Verification
from anim.optimization.writing import changed_clips, write_solutions
from anim.sampling.times import SHORTER_CLIP, check_duration

SEARCH_BOUND_FRACTION = 0.985  # of the bound, for the search; the rest covers errors outside its sample points


@dataclass(frozen=True, slots=True)
class Optimized:
    """The new document, with solutions and verifications by index of the clip.

    moved: (node, path) of changed rest values. without_loss: indices of the clips without a lossy solution.
    unchanged: whether the input is the output of the same request.
    """

    document: Document
    solutions: Mapping[int, Solution]
    verdicts: Mapping[int, Verification]
    moved: tuple[tuple[int, str], ...] = ()
    without_loss: tuple[int, ...] = ()
    unchanged: bool = False

    @property
    def max_error(self) -> float:
        """The largest error of any clip, in metres; 0 without one."""
        return max((each.error.max_error for each in self.verdicts.values()), default=0.0)


def optimize(
    document: Document,
    scene: Scene,
    clips: Sequence[Clip],
    request: Request,
    *,
    chosen: Sequence[int] | None = None,
    workers: int = 1,
    start: str = "spawn",
    detailed: bool = False,
    verified: bool = True,
    earlier: Mapping[int, ClipResult] | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Optimized:
    """Return the document with smaller animations, each within the bounds as measured on the written data.

    scene, clips: of the document. chosen: indices of the clips to optimize, all by default. workers: number of
    processes; the result is the same for any number. start: start method of `multiprocessing`. detailed: verifications
    with statistics. verified: whether errors are measured; without, only sizes are of use. earlier: results of
    `find_results` within bounds that are no larger, by index of the clip; these clips are not searched again.
    progress: called with the fraction done.
    A clip without a lossy solution within all bounds is stored losslessly. Output of the same request comes back
    unchanged.
    """
    chosen = range(len(clips)) if chosen is None else chosen
    if is_output_of(document, clips, request, chosen):
        return Optimized(document, {}, {}, unchanged=True)
    _check_durations(clips, chosen)
    base, optimizer = _prepare(document, scene, clips, request, detailed=detailed, verified=verified)
    found = _results(optimizer, chosen, earlier or {}, workers, start, progress)
    solutions = {number: each.solution.named(clips[number].name) for number, each in found.items()}
    verdicts = {number: each.verdict for number, each in found.items()}
    without_loss = [number for number, each in found.items() if each.without_loss]
    written = {number: each for number, each in solutions.items() if clips[number].tracks}
    new = write_solutions(base.document if base else document, written, request.packing)
    read_back = reader.clips(new, limited=False)
    for number in changed_clips(read_back, written):
        (verdicts[number],) = optimizer.verify([VerificationRequest(number, read_back[number])])
    done = writing.add_mark(new, read_back, _options(request, chosen))
    return Optimized(done, solutions, verdicts, base.moved if base else (), tuple(without_loss))


def is_output_of(document: Document, clips: Sequence[Clip], request: Request, chosen: Sequence[int]) -> bool:
    """Return whether a document is the output of the same request; arguments as of `optimize`."""
    return writing.has_mark(document, clips, _options(request, chosen))


def _options(request: Request, chosen: Sequence[int]) -> str:
    return f"{request.name} {tuple(chosen)}"


def find_results(
    document: Document,
    scene: Scene,
    clips: Sequence[Clip],
    request: Request,
    *,
    chosen: Sequence[int],
    workers: int = 1,
    start: str = "spawn",
    detailed: bool = False,
    verified: bool = True,
    progress: Callable[[float], None] = lambda _: None,
) -> dict[int, ClipResult]:
    """Return the results that `optimize` writes, by index of the clip; arguments as there."""
    _check_durations(clips, chosen)
    _, optimizer = _prepare(document, scene, clips, request, detailed=detailed, verified=verified)
    return _results(optimizer, chosen, {}, workers, start, progress)


def estimate_sizes(results: Mapping[int, ClipResult], request: Request) -> dict[int, float]:
    """Return the approximate number of bytes of each result of a request, by index of the clip."""
    coding = Encoding(request.packing, BYTE_COSTS[request.objective])
    return {number: each.solution.size(coding) for number, each in results.items()}


def _prepare(
    document: Document, scene: Scene, clips: Sequence[Clip], request: Request, *, detailed: bool, verified: bool
) -> tuple[RebasedDocument | None, ClipOptimizer]:
    """The document and scene with another rest pose, if it may change, and the optimizer of all clips."""
    request = _with_constraint_sources(document, _visible_clips(request, scene))
    base = rebase(document, scene, clips, exact=request.bounds.max_error == 0) if request.policy.rebase_rest else None
    after = base.scene if base else scene
    return base, ClipOptimizer(request, scene, after, tuple(clips), detailed=detailed, verified=verified)


def _results(
    optimizer: ClipOptimizer,
    chosen: Sequence[int],
    earlier: Mapping[int, ClipResult],
    workers: int,
    start: str,
    progress: Callable[[float], None],
) -> dict[int, ClipResult]:
    """The result of each chosen clip; equal clips are searched once, and those with earlier results not at all.

    Clips without tracks are equal: one stands for all, which can be tens of thousands.
    """
    unsearched = [number for number in chosen if number not in earlier]
    empty = [number for number in unsearched if not optimizer.clips[number].tracks]
    waiting = [number for number in unsearched if optimizer.clips[number].tracks] + empty[:1]
    tasks = _tasks(optimizer, waiting) if waiting else []
    first = _first_equal(tasks)
    distinct = [task for n, task in enumerate(tasks) if first[n] == n]

    def name(item: tuple[int, object]) -> str:
        return reader.clip_label(optimizer.clips[item[0]].name, item[0])

    found: dict[int, ClipResult] = {}
    batches = batch_clips(distinct, optimizer.dividers[0]) if distinct else []
    with process_pool(min(workers, len(batches)), optimizer, start=start) as pool:
        results = pool.each(optimize_clips, batches, label=lambda batch: name(batch[0]), work=_work)
        for batch, some in zip(batches, results, strict=True):
            found.update(zip((number for number, _ in batch), some, strict=True))
            progress(len(found) / len(distinct))
    found = {number: found[tasks[first[n]][0]] for n, (number, _) in enumerate(tasks)}
    found |= dict.fromkeys(empty, found[empty[0]]) if empty else {}
    return {number: earlier[number] if number in earlier else found[number] for number in chosen}


def _first_equal(tasks: Sequence[tuple[int, Task]]) -> list[int]:
    """For each task the first one with the same result: equal clips are optimized once."""
    first = first_equal([(task.clip,) for _, task in tasks])
    return [
        k if tasks[k][1].at_rest == task.at_rest else n
        for n, (k, (_, task)) in enumerate(zip(first, tasks, strict=True))
    ]


def _work(batch: Sequence[tuple[int, Task]]) -> float:
    """Estimate of the work on a batch: the number of its values."""
    return float(sum(track.values.size for _, task in batch for track in task.clip.tracks))


def _visible_clips(request: Request, scene: Scene) -> Request:
    """The request; invisible nodes stay if the scene has no vertex, because its nodes are then the motion."""
    if has_vertices(scene):
        return request
    return replace(request, policy=replace(request.policy, drop_invisible=False))


def _with_constraint_sources(document: Document, request: Request) -> Request:
    """The request; invisible nodes stay if players rotate others by them, since no error of that is measured."""
    policy = request.policy
    if not policy.drop_invisible:
        return request
    return replace(request, policy=replace(policy, keep=policy.keep | constraint_sources(document.json)))


def _tasks(optimizer: ClipOptimizer, chosen: Sequence[int]) -> list[tuple[int, Task]]:
    shared = find_constants(optimizer.context(), optimizer.clips)
    tasks, max_error = [], optimizer.request.bounds.max_error
    for i in chosen:
        clip = optimizer.clips[i]
        targets = [(-1 if track.node is None else track.node, track.path) for track in clip.tracks]
        values = tuple(shared.values.get(target, ()) for target in targets)
        unused = tuple(target in shared.unused for target in targets)
        at_rest = shared.at_rest(i, max_error)
        tasks.append((i, Task(clip, values, unused, SEARCH_BOUND_FRACTION * max_error, at_rest)))
    return tasks


def _check_durations(clips: Sequence[Clip], chosen: Sequence[int]) -> None:
    """Raise UnsupportedError for a clip that lasts too long to measure between keys, as `frame_times` does."""
    for number in chosen:
        if not clips[number].tracks:
            continue
        try:
            check_duration(0.0, clips[number].end, fps=FPS, help=SHORTER_CLIP)
        except AnimError as error:
            raise error.at(reader.clip_label(clips[number].name, number)) from None
