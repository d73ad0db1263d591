"""Optimization of one clip, the task of one process: search and verification until all bounds hold."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from anim.measure.continuous_bound.prover import Prover
from anim.measure.error.metric import ErrorMetric, MotionError
from anim.measure.error.surface import diagonal
from anim.model import Clip, Scene
from anim.optimization.clip import Task, solve
from anim.optimization.options import EFFORTS, Effort, Request
from anim.optimization.search.context import Context, build_context
from anim.optimization.search.plan import Solution
from anim.optimization.tracks.lossless_size import min_lossless_bytes
from anim.optimization.tracks.quantization import BYTE_COSTS, Encoding
from anim.optimization.tracks.redundant_keys import drop_redundant_keys
from anim.optimization.verification import Verification, verify

RETRY_FACTOR = 0.97  # applied to bound / measured error for the next search
NEW_VERTEX_RETRY_FACTOR = 0.995  # the same if the worst vertex was not among the measured points
MAX_REDUCED_KEY_FRACTION = 0.5  # of the source's keys; below it the lossless version cannot be smaller
MAX_ROUNDS = 6  # of search and verification; a clip that fails the last one is stored losslessly
UNVERIFIED = Verification(MotionError(0.0, 0.0, "", "", 0), "", None, 0.0)


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
    ) -> None:
        self.request = request
        self.before = before
        self.after = after
        self.clips = clips
        self.detailed = detailed
        self.verified = verified

    def context(self, extra: frozenset[tuple[int, int]] = frozenset()) -> Context:
        """Return the search context; extra: additional points, (index of the surface, index of the vertex)."""
        if not extra:
            return self._default_context
        return self._context(extra)

    def verify(self, number: int, after: Clip) -> Verification:
        """Return the error of a new version of clip `number` against its source."""
        if not self.verified:
            return UNVERIFIED
        return verify(
            self._ruler,
            self.clips[number],
            after,
            bounds=self.request.bounds,
            reference=self.request.policy.reference,
            players=self.request.players,
            detailed=self.detailed,
            prover=self._prover,
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
        return build_context(
            self.after,
            self.clips,
            bounds=request.bounds,
            policy=request.policy,
            coding=Encoding(request.packing, BYTE_COSTS[request.objective]),
            effort=EFFORTS[request.effort],
            extra=extra,
        )

    @cached_property
    def _default_context(self) -> Context:
        return self._context(frozenset())

    @cached_property
    def _ruler(self) -> ErrorMetric:
        fraction = self.request.bounds.shell / (diagonal(self.before) or 1.0)
        shell = None if self.request.policy.drop_invisible else fraction
        return ErrorMetric(self.before, self.after, shell=shell, clips=self.clips)

    @cached_property
    def _prover(self) -> Prover:
        return Prover(self._ruler)


def optimize_clip(optimizer: ClipOptimizer, item: tuple[int, Task]) -> ClipResult:
    """Return clip `item[0]` in the fewest bytes found within all bounds, verified as stored.

    The lossless version competes too: a few splines or steps can be smaller than the lines that replace them.
    """
    number, task = item
    context = optimizer.context()
    found = [
        each
        for effort in context.effort.all()
        if (each := _search_within_bounds(optimizer, number, task, effort)) is not None
    ]
    best = min(found, key=lambda each: each.solution.size(context.coding), default=None)
    is_exact = context.bounds.max_error == 0
    if best is not None and (is_exact or _keys(best.solution.clip) < MAX_REDUCED_KEY_FRACTION * _keys(task.clip)):
        return best
    if best is not None and best.solution.size(context.coding) <= _min_lossless_bytes(context, task.clip):
        return best
    exact = solve(replace(context, bounds=replace(context.bounds, max_error=0.0)), task)
    assert exact is not None
    if best is not None and best.solution.size(context.coding) <= exact.size(context.coding):
        return best
    if best is None and not is_exact:
        return ClipResult(exact, optimizer.verify(number, exact.clip), without_loss=True)
    return _verify(optimizer, number, exact)


def _min_lossless_bytes(context: Context, clip: Clip) -> float:
    """Bytes that the lossless version takes at least."""
    if context.policy.drop_invisible:  # its channels of nodes without vertices are dropped
        return 0.0
    return min_lossless_bytes(clip.tracks, context.coding.byte_costs)


def _verify(optimizer: ClipOptimizer, number: int, solution: Solution) -> ClipResult:
    """Verify a solution without its redundant keys; if that exceeds a bound, with them."""
    slim = drop_redundant_keys(solution, optimizer.after.skeleton, optimizer.request)
    if slim is not None and (found := optimizer.verify(number, slim.clip)).holds:
        return ClipResult(slim, found)
    return ClipResult(solution, optimizer.verify(number, solution.clip))


def _keys(clip: Clip) -> int:
    return sum(len(track.times) for track in clip.tracks)


def _search_within_bounds(optimizer: ClipOptimizer, number: int, task: Task, effort: Effort) -> ClipResult | None:
    """Search until a solution passes verification; None if none does.

    After each failure the vertex with the largest error becomes a measured point, and the bound is reduced.
    """
    extra: frozenset[tuple[int, int]] = frozenset()
    for _ in range(MAX_ROUNDS):
        solution = solve(replace(optimizer.context(extra), effort=effort), task)
        if solution is None:
            return None
        result = _verify(optimizer, number, solution)
        found = result.verdict
        if found.holds:
            return result
        worst = optimizer.worst_vertex(found)
        factor = NEW_VERTEX_RETRY_FACTOR if worst - extra else min(RETRY_FACTOR / found.usage, RETRY_FACTOR)
        extra |= worst
        task = replace(task, bound=task.bound * factor)
    return None
