"""One clip from search to verdict, again until it holds: the work that each process does by itself."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from anim.measure.continuous_bound.prover import Prover
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.surface import diagonal
from anim.model import Clip, Scene
from anim.optimization.clip import Task, solve
from anim.optimization.options import EFFORTS, Effort
from anim.optimization.request import Request
from anim.optimization.search.context import Context, build_context
from anim.optimization.search.solution import Solution
from anim.optimization.tracks.quantization import BYTE_COSTS, Encoding
from anim.optimization.verification import Verification, verify

TIGHTER = 0.97  # of the share that a clip was beyond its bound, for the next search
HARDLY = 0.995  # less for the next search where the vertex that was off most had not been measured
REDUCED_BUDGET = 0.5  # of the source's keys; with fewer, a clip is smaller than any version without loss
ROUNDS = 6  # of searching and verifying; after them a clip that still fails is kept without loss


@dataclass(frozen=True, slots=True)
class ClipResult:
    """A clip that needs no more work: what became of it, and how far it is from its source.

    without_loss: whether no lossy way was found that holds all bounds.
    """

    solution: Solution
    verdict: Verification
    without_loss: bool = False


class ClipOptimizer:
    """What every process works with; each part is made where it is first needed.

    before, after: the scene as it was, and in its new rest pose. clips: all of the file. detailed: whether verdicts are
    to have statistics.
    """

    def __init__(
        self, request: Request, before: Scene, after: Scene, clips: tuple[Clip, ...], *, detailed: bool = False
    ) -> None:
        self.request = request
        self.before = before
        self.after = after
        self.clips = clips
        self.detailed = detailed

    def context(self, extra: frozenset[tuple[int, int]] = frozenset()) -> Context:
        """Return the setting, with some more vertices measured, (number of the surface, number of the vertex)."""
        if not extra:
            return self._default_context
        return self._context(extra)

    def verify(self, number: int, after: Clip) -> Verification:
        """Return how far a new version of clip `number` is from its source."""
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
        """Return the vertex that was off most, (number of the surface, number of the vertex); none of a shell."""
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
        share = self.request.bounds.shell / (diagonal(self.before) or 1.0)
        return ErrorMetric(self.before, self.after, shell=None if self.request.policy.drop_invisible else share)

    @cached_property
    def _prover(self) -> Prover:
        return Prover(self._ruler)


def optimize_clip(site: ClipOptimizer, item: tuple[int, Task]) -> ClipResult:
    """Return clip `item[0]` in the fewest bytes found within all bounds, judged as it will be stored.

    Splines and steps as they are compete too: lines in place of a few of them can take more.
    """
    number, task = item
    setting = site.context()
    found = [each for effort in setting.effort.all() if (each := _within(site, number, task, effort)) is not None]
    best = min(found, key=lambda each: each.solution.size(setting.coding), default=None)
    if best is not None and _keys(best.solution.clip) < REDUCED_BUDGET * _keys(task.clip):
        return best
    exact = solve(replace(setting, bounds=replace(setting.bounds, max_error=0.0)), task)
    assert exact is not None
    if best is not None and best.solution.size(setting.coding) <= exact.size(setting.coding):
        return best
    is_last_resort = best is None and site.request.bounds.max_error > 0
    return ClipResult(exact, site.verify(number, exact.clip), without_loss=is_last_resort)


def verify_solution(site: ClipOptimizer, item: tuple[int, Clip]) -> Verification:
    """Return how far a new version of clip `item[0]` is from its source."""
    return site.verify(*item)


def _keys(clip: Clip) -> int:
    return sum(len(track.times) for track in clip.tracks)


def _within(site: ClipOptimizer, number: int, task: Task, effort: Effort) -> ClipResult | None:
    """What a search finds that holds, None if nothing does.

    After each search that fails, the vertex that was off most is measured too, and the search gets less to spend.
    """
    extra: frozenset[tuple[int, int]] = frozenset()
    for _ in range(ROUNDS):
        solution = solve(replace(site.context(extra), effort=effort), task)
        if solution is None:
            return None
        found = site.verify(number, solution.clip)
        if found.holds:
            return ClipResult(solution, found)
        worst = site.worst_vertex(found)
        factor = HARDLY if worst - extra else min(TIGHTER / found.usage, TIGHTER)
        extra |= worst
        task = replace(task, bound=task.bound * factor)
    return None
