"""One clip from search to verdict, again until it holds: the work that each process does by itself."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from anim.measure.error import Ruler
from anim.measure.proof.certified import Prover
from anim.measure.surface import diagonal
from anim.model import Clip, Scene
from anim.optimize.clip import Task, solve
from anim.optimize.coding import PRICES, Coding
from anim.optimize.limits import EFFORTS, Packing
from anim.optimize.request import Request
from anim.optimize.setting import Setting, setting
from anim.optimize.solution import Solution
from anim.optimize.verify import Verdict, verdict

TIGHTER = 0.97  # of the share that a clip was beyond its bound, for the next search
HARDLY = 0.995  # less for the next search where the vertex that was off most had not been measured
ROUNDS = 6  # of searching and verifying; after them a clip that still fails is kept without loss


@dataclass(frozen=True, slots=True)
class Finished:
    """A clip that needs no more work: what became of it, and how far it is from its source.

    without_loss: whether no lossy way was found that holds all bounds.
    """

    solution: Solution
    verdict: Verdict
    without_loss: bool = False


class Site:
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

    def setting(self, extra: frozenset[tuple[int, int]] = frozenset()) -> Setting:
        """Return the setting, with some more vertices measured, (number of the surface, number of the vertex)."""
        if not extra:
            return self._usual_setting
        return self._setting(extra)

    def judged(self, number: int, after: Clip) -> Verdict:
        """Return how far a new version of clip `number` is from its source."""
        return verdict(
            self._ruler,
            self.clips[number],
            after,
            bounds=self.request.bounds,
            reference=self.request.policy.reference,
            players=self.request.players,
            detailed=self.detailed,
            prover=self._prover,
        )

    def worst_vertex(self, found: Verdict) -> frozenset[tuple[int, int]]:
        """Return the vertex that was off most, (number of the surface, number of the vertex); none of a shell."""
        error = found.error
        names = [surface.name for surface, _ in self._ruler.pairs.surfaces]
        return frozenset((i, error.vertex) for i, name in enumerate(names) if name == error.place and error.vertex >= 0)

    def _setting(self, extra: frozenset[tuple[int, int]]) -> Setting:
        request = self.request
        return setting(
            self.after,
            self.clips,
            bounds=request.bounds,
            policy=request.policy,
            coding=Coding(request.packing, PRICES[request.objective]),
            effort=EFFORTS[request.effort],
            extra=extra,
        )

    @cached_property
    def _usual_setting(self) -> Setting:
        return self._setting(frozenset())

    @cached_property
    def _ruler(self) -> Ruler:
        share = self.request.bounds.shell / (diagonal(self.before) or 1.0)
        return Ruler(self.before, self.after, shell=None if self.request.policy.drop_invisible else share)

    @cached_property
    def _prover(self) -> Prover:
        return Prover(self._ruler)


def finished(site: Site, item: tuple[int, Task]) -> Finished:
    """Return clip `item[0]` as small as the search makes it within all bounds, judged as it will be stored.

    After each search that fails, the vertex that was off most is measured too, and the search gets less to spend.
    """
    number, task = item
    extra: frozenset[tuple[int, int]] = frozenset()
    for _ in range(ROUNDS):
        solution = solve(site.setting(extra), task)
        if solution is None:
            break
        found = site.judged(number, solution.clip)
        if found.holds:
            return _unless_exact_is_smaller(site, number, Finished(solution, found), task)
        worst = site.worst_vertex(found)
        factor = HARDLY if worst - extra else min(TIGHTER / found.strain, TIGHTER)
        extra |= worst
        task = replace(task, bound=task.bound * factor)
    exact = _exact(site, task)
    return Finished(exact, site.judged(number, exact.clip), without_loss=site.request.bounds.max_error > 0)


def _unless_exact_is_smaller(site: Site, number: int, lossy: Finished, task: Task) -> Finished:
    """Lines in place of a few splines and steps can take more bytes than these."""
    if site.request.packing is not Packing.CORE:  # what a codec makes of numbers that nobody rounded is no gain
        return lossy
    exact, prices = _exact(site, task), PRICES[site.request.objective]
    if exact.size(prices) >= lossy.solution.size(prices):
        return lossy
    return Finished(exact, site.judged(number, exact.clip))


def _exact(site: Site, task: Task) -> Solution:
    usual = site.setting()
    exact = solve(replace(usual, bounds=replace(usual.bounds, max_error=0.0)), task)
    assert exact is not None
    return exact
