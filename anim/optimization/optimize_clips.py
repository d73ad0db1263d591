"""Optimization of clips, the task of one process: search and verification until all bounds hold."""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeAlias, TypeVar

from anim.model import Clip
from anim.optimization.clip import Task, solve
from anim.optimization.clip_optimizer import ClipOptimizer, ClipResult, VerificationRequest
from anim.optimization.options import Effort
from anim.optimization.search.context import Context
from anim.optimization.search.lockstep import SearchRequest
from anim.optimization.search.long_clips import search_all
from anim.optimization.search.plan import FoundKeys, Solution
from anim.optimization.search.reduced_context import reduce_context
from anim.optimization.tracks.lossless_size import min_lossless_bytes
from anim.optimization.tracks.redundant_keys import drop_redundant_keys

RETRY_FACTOR = 0.97  # applied to bound / measured error for the next search
NEW_VERTEX_RETRY_FACTOR = 0.995  # the same if the worst vertex was not among the measured points
MAX_REDUCED_KEY_FRACTION = 0.5  # of the source's keys; below it the lossless version cannot be smaller
MAX_ROUNDS = 6  # of search and verification; a clip that fails the last one is stored losslessly

Result = TypeVar("Result")
Asked: TypeAlias = tuple[Effort, SearchRequest] | VerificationRequest
Optimizing: TypeAlias = Generator[Asked, Any, Result]  # is sent the result of each


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
