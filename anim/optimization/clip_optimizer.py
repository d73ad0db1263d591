"""Data that all clips of a file share in their optimization in one process: search context, and verification."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

from anim.measure.continuous_bound.prover import Prover
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.motion_error import MotionError
from anim.measure.error.surface import diagonal
from anim.measure.error.whole_scene import WholeScene
from anim.model import Clip, Scene
from anim.optimization.options import Request, find_effort
from anim.optimization.search.context import Context, build_context
from anim.optimization.search.plan import Solution
from anim.optimization.tracks.quantization import BYTE_COSTS, Encoding
from anim.optimization.verification import Verification, verify_clips
from anim.sampling.scene_parts import SceneDivider, ScenePart

UNVERIFIED = Verification(MotionError(0.0, 0.0, "", "", 0), "", None, 0.0)


class VerificationRequest(NamedTuple):
    """A new version of a clip to verify against its source. number: index of the clip in the file."""

    number: int
    after: Clip


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
