"""Optimization of one clip, the task of one process: search and verification until all bounds hold."""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias, TypeVar

from anim.measure.continuous_bound.prover import Prover
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.motion_error import MotionError
from anim.measure.error.surface import diagonal
from anim.measure.error.whole_scene import WholeScene
from anim.model import Clip, Scene
from anim.optimization.clip import Task, solve
from anim.optimization.options import Effort, Request, find_effort
from anim.optimization.search.context import Context, build_context
from anim.optimization.search.lockstep import SearchRequest
from anim.optimization.search.long_clips import search_all
from anim.optimization.search.plan import FoundKeys, Solution
from anim.optimization.search.reduced_context import reduce_context
from anim.optimization.tracks.lossless_size import min_lossless_bytes
from anim.optimization.tracks.quantization import BYTE_COSTS, Encoding
from anim.optimization.tracks.redundant_keys import drop_redundant_keys
from anim.optimization.verification import Verification, verify_clips
from anim.sampling.scene_parts import SceneDivider, ScenePart

RETRY_FACTOR = 0.97  # applied to bound / measured error for the next search
NEW_VERTEX_RETRY_FACTOR = 0.995  # the same if the worst vertex was not among the measured points
MAX_REDUCED_KEY_FRACTION = 0.5  # of the source's keys; below it the lossless version cannot be smaller
MAX_ROUNDS = 6  # of search and verification; a clip that fails the last one is stored losslessly
UNVERIFIED = Verification(MotionError(0.0, 0.0, "", "", 0), "", None, 0.0)


class VerificationRequest(NamedTuple):
    """A new version of a clip to verify against its source. number: index of the clip in the file."""

    number: int
    after: Clip


Result = TypeVar("Result")
Asked: TypeAlias = tuple[Effort, SearchRequest] | VerificationRequest
Optimizing: TypeAlias = Generator[Asked, Any, Result]  # is sent the result of each


@dataclass(frozen=True, slots=True)
class ClipResult:
    """An optimized clip with its verification.

    without_loss: whether no lossy solution within all bounds was found.
    """

    solution: Solution
    verdict: Verification
    without_loss: bool = False


class ClipOptimizer:
    """Data shared by all clips of a file in one process; each part is computed on first use.

    before, after: the scene in its original and in its new rest pose. clips: all of the file. detailed: whether
    verifications include statistics. verified: whether errors are measured; else every result passes, for its size.
    whole: the optimizer of the whole file, if `before` and `after` are parts of its scenes; sizes are those of its own.
    """

    def __init__(
        self,
        request: Request,
        before: Scene,
        after: Scene,
        clips: tuple[Clip, ...],
        *,
        detailed: bool = False,
        verified: bool = True,
        whole: ClipOptimizer | None = None,
    ) -> None:
        self.request = request
        self.before = before
        self.after = after
        self.clips = clips
        self.detailed = detailed
        self.verified = verified
        self._whole = whole

    def context(self, extra: frozenset[tuple[int, int]] = frozenset()) -> Context:
        """Return the search context; extra: additional points, (index of the surface, index of the vertex)."""
        if not extra:
            return self._default_context
        return self._context(extra)

    def verify(self, asked: Sequence[VerificationRequest]) -> list[Verification]:
        """Return the errors of new versions of clips against their sources."""
        if not self.verified:
            return [UNVERIFIED] * len(asked)
        return verify_clips(
            self._ruler,
            [(self.clips[each.number], each.after) for each in asked],
            bounds=self.request.bounds,
            reference=self.request.policy.reference,
            players=self.request.players,
            detailed=self.detailed,
            prover=self._prover,
        )

    def on_part(self, clips: Sequence[Clip]) -> tuple[ScenePart, ClipOptimizer] | None:
        """Return the part of the scene that clips move, if it is small, with an optimizer of these clips on it."""
        before, after = (each.part(clips) for each in self.dividers)
        if before is None or after is None:
            return None
        policy = self.request.policy
        keep = frozenset(i for i, node in enumerate(before.nodes.tolist()) if node in policy.keep)
        request, own = replace(self.request, policy=replace(policy, keep=keep)), tuple(map(before.into, clips))
        return before, ClipOptimizer(
            request, before.scene, after.scene, own, detailed=self.detailed, verified=self.verified, whole=self
        )

    def worst_vertex(self, found: Verification) -> frozenset[tuple[int, int]]:
        """Return the vertex with the largest error, (index of the surface, index of the vertex).

        Empty for shell points.
        """
        error = found.error
        names = [surface.name for surface, _ in self._ruler.pairs.surfaces]
        return frozenset((i, error.vertex) for i, name in enumerate(names) if name == error.place and error.vertex >= 0)

    def _context(self, extra: frozenset[tuple[int, int]]) -> Context:
        request = self.request
        found = build_context(
            self.after,
            self.clips,
            bounds=request.bounds,
            policy=request.policy,
            coding=Encoding(request.packing, BYTE_COSTS[request.objective]),
            effort=find_effort(request.effort, request.packing),
            extra=extra,
        )
        return found if self._whole is None else replace(found, size=self._whole.context().size)

    @cached_property
    def _default_context(self) -> Context:
        return self._context(frozenset())

    @cached_property
    def dividers(self) -> tuple[SceneDivider, SceneDivider]:
        """Those of the scenes before and after."""
        found = SceneDivider(self.before)
        return found, found if self.after is self.before else SceneDivider(self.after)

    @cached_property
    def _diagonal(self) -> float:
        return diagonal(self.before) if self._whole is None else self._whole._diagonal

    @cached_property
    def _ruler(self) -> ErrorMetric:
        shell = None if self.request.policy.drop_invisible else self.request.bounds.shell
        scene = (self if self._whole is None else self._whole).before
        whole = WholeScene.of(scene, self._diagonal)
        return ErrorMetric(self.before, self.after, shell=shell, clips=self.clips, whole=whole)

    @cached_property
    def _prover(self) -> Prover:
        return Prover(self._ruler)


def optimize_clips(optimizer: ClipOptimizer, items: Sequence[tuple[int, Task]]) -> list[ClipResult]:
    """Return clips in the fewest bytes found within all bounds, verified as stored.

    items: of each clip, its number in the file and its task.

    All are searched and verified side by side, on the part of the scene that they move if that is small.
    """
    found = optimizer.on_part([task.clip for _, task in items])
    if found is None:
        return _optimize_all(optimizer, items)
    part, smaller = found
    tasks = [replace(task, clip=clip) for (_, task), clip in zip(items, smaller.clips, strict=True)]
    results = _optimize_all(smaller, list(enumerate(tasks)))
    return [replace(each, solution=replace(each.solution, clip=part.out_of(each.solution.clip))) for each in results]


def _optimize_all(optimizer: ClipOptimizer, items: Sequence[tuple[int, Task]]) -> list[ClipResult]:
    """The results of clips, whose numbers are those of the optimizer.

    The lossless version competes too: a few splines or steps can be smaller than the lines that replace them.
    """
    steps = [_optimize(optimizer, number, task) for number, task in items]
    found: dict[int, ClipResult] = {}
    searches: dict[int, tuple[Effort, SearchRequest]] = {}
    answers: dict[int, Any] = dict.fromkeys(range(len(steps)))
    while answers:
        versions: dict[int, VerificationRequest] = {}
        for n, answer in answers.items():
            try:
                asked = steps[n].send(answer)
            except StopIteration as end:
                found[n] = end.value
                continue
            if isinstance(asked, VerificationRequest):
                versions[n] = asked
            else:
                searches[n] = asked
        if versions:  # first, so that searches wait for those that follow from them
            answers = dict(zip(versions, optimizer.verify(list(versions.values())), strict=True))
        else:
            answers, searches = _search(optimizer, searches), {}
    return [found[n] for n in range(len(steps))]


def _search(optimizer: ClipOptimizer, asked: Mapping[int, tuple[Effort, SearchRequest]]) -> dict[int, FoundKeys | None]:
    """The result of each search; those with equal efforts run side by side, on the points that any of them needs."""
    answers: dict[int, FoundKeys | None] = {}
    for effort in dict.fromkeys(effort for effort, _ in asked.values()):
        some = {n: request for n, (one, request) in asked.items() if one == effort}
        extra = frozenset().union(*(request.extra for request in some.values()))
        context, requests = reduce_context(optimizer.context(extra), list(some.values()))
        answers.update(zip(some, search_all(context, requests, effort), strict=True))
    return answers


def _optimize(optimizer: ClipOptimizer, number: int, task: Task) -> Optimizing[ClipResult]:
    """Optimize one clip: yields its searches and verifications, of which it takes the results."""
    context = optimizer.context()
    found = []
    for effort in context.effort.all() if context.is_measurable else ():
        each = yield from _search_within_bounds(optimizer, number, task, effort)
        if each is not None:
            found.append(each)
    best = min(found, key=lambda each: each.solution.size(context.coding), default=None)
    is_exact = context.bounds.max_error == 0
    if best is not None and (is_exact or _keys(best.solution.clip) < MAX_REDUCED_KEY_FRACTION * _keys(task.clip)):
        return best
    if best is not None and best.solution.size(context.coding) <= _min_lossless_bytes(context, task):
        return best
    lossless = replace(context, bounds=replace(context.bounds, max_error=0.0))
    exact = yield from _solve(lossless, task, context.effort)
    assert exact is not None
    if best is not None and best.solution.size(context.coding) <= exact.size(context.coding):
        return best
    if best is None and not is_exact:
        verdict = yield VerificationRequest(number, exact.clip)
        return ClipResult(exact, verdict, without_loss=True)
    return (yield from _verify(optimizer, number, exact))


def _solve(context: Context, task: Task, effort: Effort) -> Optimizing[Solution | None]:
    """The solution of a clip, whose searches are yielded with their effort."""
    steps = solve(context, task)
    answer: FoundKeys | None = None
    while True:
        try:
            request = steps.send(answer)
        except StopIteration as end:
            solution: Solution | None = end.value
            return solution
        answer = yield effort, request


def _min_lossless_bytes(context: Context, task: Task) -> float:
    """Bytes that the lossless version takes at least."""
    if context.policy.drop_invisible:  # its channels of nodes without vertices are dropped
        return 0.0
    stays = [not task.is_droppable(i, context.policy) for i in range(len(task.clip.tracks))]
    return min_lossless_bytes(task.clip.tracks, stays, context.coding.byte_costs)


def _verify(optimizer: ClipOptimizer, number: int, solution: Solution) -> Optimizing[ClipResult]:
    """Verify a solution without its redundant keys; if that exceeds a bound, with them."""
    slim = drop_redundant_keys(solution, optimizer.after.skeleton, optimizer.request)
    if slim is not None and (found := (yield VerificationRequest(number, slim.clip))).holds:
        return ClipResult(slim, found)
    return ClipResult(solution, (yield VerificationRequest(number, solution.clip)))


def _keys(clip: Clip) -> int:
    return sum(len(track.times) for track in clip.tracks)


def _search_within_bounds(
    optimizer: ClipOptimizer, number: int, task: Task, effort: Effort
) -> Optimizing[ClipResult | None]:
    """Search until a solution passes verification; None if none does.

    After each failure the vertex with the largest error becomes a measured point, and the bound is reduced.
    """
    for _ in range(MAX_ROUNDS):
        solution = yield from _solve(optimizer.context(), task, effort)
        if solution is None:
            return None
        result = yield from _verify(optimizer, number, solution)
        found = result.verdict
        if found.holds:
            return result
        if not math.isfinite(found.usage):  # the ends cannot be stored, within whatever bound
            return None
        worst = optimizer.worst_vertex(found)
        factor = NEW_VERTEX_RETRY_FACTOR if worst - task.extra else min(RETRY_FACTOR / found.usage, RETRY_FACTOR)
        task = replace(task, bound=task.bound * factor, extra=task.extra | worst)
    return None
