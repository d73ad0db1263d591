"""Trial of a plan: from budgets to keys, played motion, errors and bytes."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.maths import matrix, quaternion
from anim.measure.error.point_matrix import stack_points
from anim.model import Skeleton
from anim.optimization.options import Bounds
from anim.optimization.search import playback
from anim.optimization.search.candidates import Candidate, Candidates
from anim.optimization.search.parent_compensation import ParentCompensation, budget_gain
from anim.optimization.search.plan import Plan, RotationTarget, TrackAction, TrialResult
from anim.optimization.search.size_estimate import SizeEstimate
from anim.optimization.search.source_motion import PATHS, ROTATION, SourceMotion, farthest
from anim.optimization.search.time_axes import SharedAxis, TimeAxisSearch
from anim.optimization.search.trial_cache import TrialCache
from anim.optimization.tracks import quantization
from anim.optimization.tracks.quantization import EncodedKeys, Encoding
from anim.sampling.world import local_matrices

CONSTANT_BUDGET_FACTOR = 1.5  # times a track's budget: tolerance for dropping it, or for a single key
QUANTIZATION_BUDGET_FRACTION = 0.5  # of a budget
CHORD_BOUND_FRACTION = 0.02  # of the bound; if slerp and nlerp are closer, only slerp is measured
MIN_INTERVAL_S = 1e-4  # s; minimum time step of a speed
MAX_BLOCK_MATRICES = 100_000  # world matrices of nodes at a time: 10 MB; more are measured in blocks of times
MIN_BLOCK_TIMES = 64


class TrialRunner:
    """Runs plans for one clip; data common to all trials is prepared once.

    droppable: (G,) mask of the tracks that may be dropped. shared: per track, constants of other clips, the most
    frequent first.
    """

    def __init__(
        self,
        skeleton: Skeleton,
        source: SourceMotion,
        usage: BoundUsage,
        coding: Encoding,
        droppable: Bools,
        shared: Sequence[Sequence[Floats]],
    ) -> None:
        self.source = source
        self._skeleton = skeleton
        self._usage = usage
        self._sizes = SizeEstimate(source, coding)
        self._droppable = droppable
        self._bound = usage.bounds.max_error
        self._nodes = np.array([each.node for each in source.moving], np.int64)
        self._paths = np.array([PATHS.index(each.path) for each in source.moving], np.int64)
        self._meters = np.array([each.meters for each in source.moving])
        self._from_rest = np.array([each.from_rest for each in source.moving])
        self._from_middle = np.array([each.from_middle for each in source.moving])
        self._rest = [_rest(source, path) for path in PATHS]
        self._constants = _constant_errors(source, shared)
        self._layouts = TimeAxisSearch(source, coding, self._bound)
        self._candidates = Candidates(source, coding.packing)
        self._results = TrialCache()

    def run(self, plan: Plan, *, smaller_than: float = math.inf) -> TrialResult:
        """Return the result of a plan.

        Component-wise interpolation is measured only if the result is otherwise within the bounds and has fewer bytes
        than `smaller_than`.
        """
        outcome = self.run_smaller(plan, math.inf, smaller_than=smaller_than)
        assert outcome is not None
        return outcome

    def run_smaller(self, plan: Plan, limit: float, *, smaller_than: float = math.inf) -> TrialResult | None:
        """Return the same; None, without a measurement, for a result with `limit` or more bytes."""
        actions = self._actions(plan)
        axes = self._layouts.axes(plan.axes, np.flatnonzero(actions == TrackAction.KEYED), plan.budgets)
        tolerances = (
            QUANTIZATION_BUDGET_FRACTION * plan.budgets * plan.coarser / np.maximum(self._meters, 1e-30)
        ).tolist()
        if self._sizes.min_size(actions, axes, tolerances) >= limit:
            return None
        constants = self._choose_constants(actions, plan)
        name = self._name(plan.rotation_target, actions, constants, axes, tolerances)
        known = self._results.get(name)
        if known is not None and (known.worst > 1 or known.size >= smaller_than):
            return None if known.size >= limit else replace(known, plan=plan)
        shown = [part.copy() if path in self._paths else part for path, part in enumerate(self.source.local)]
        keys = self._single_key(actions, constants, shown)
        for i, candidate in self._key_candidates(plan.rotation_target, axes, tolerances, shown[ROTATION]):
            keys[i] = candidate.stored
            shown[self._paths[i]][self._nodes[i]] = candidate.shown
        on = {i: axis.keys for axis in axes for i in axis.members}
        size = self._sizes.size(actions, keys, axes)
        if size >= limit:
            return None
        usage = self._usage
        outcome = TrialResult(plan, actions, keys, on, usage.slerp_raw(shown), usage.own(shown), size)
        self._results.add(name, outcome)
        if outcome.worst > 1 or size >= smaller_than or not self._chords_matter(axes, keys):
            return outcome
        return replace(outcome, usage=np.maximum(outcome.usage, self._nlerp_usage(axes, keys, shown)))

    @cached_property
    def leeway(self) -> Floats:
        """Ratio of each track's moment arm to the compensated one (G,)."""
        return budget_gain(self._skeleton, self.source, self.source.points)

    @cached_property
    def _compensation(self) -> ParentCompensation:
        return ParentCompensation(self._skeleton, self.source, self._candidates)

    def _key_candidates(
        self, aim: RotationTarget, axes: Sequence[SharedAxis], tolerances: Sequence[float], rotation: Floats
    ) -> Iterator[tuple[int, Candidate]]:
        """Every keyed track with its candidate. rotation: (N, W, 4) played values of all others."""
        if aim is RotationTarget.WORLD:
            yield from self._compensation.follow(axes, tolerances, rotation)
            axes = [
                SharedAxis(axis.keys, tuple(i for i in axis.members if self._paths[i] != ROTATION)) for axis in axes
            ]
        for axis in axes:
            yield from self._candidates.of(axis, tolerances)

    def _actions(self, plan: Plan) -> Ints:
        allowance = np.maximum(CONSTANT_BUDGET_FACTOR * plan.budgets, plan.threshold)
        actions = np.full(len(allowance), TrackAction.KEYED, np.int64)
        actions[self._from_middle <= allowance] = TrackAction.CONSTANT
        actions[(self._from_rest <= allowance) & self._droppable] = TrackAction.DROPPED
        return actions

    def _choose_constants(self, actions: Ints, plan: Plan) -> dict[int, int]:
        """The number of the value of each constant track: of other clips, else the rest value, else the middle."""
        constant = np.flatnonzero(actions == TrackAction.CONSTANT)
        allowances = np.maximum(CONSTANT_BUDGET_FACTOR * plan.budgets[constant], plan.threshold)
        return {
            i: next((n for n, (_, error) in enumerate(self._constants[i]) if error <= allowance), -1)
            for i, allowance in zip(constant.tolist(), allowances.tolist(), strict=True)
        }

    def _name(
        self,
        target: RotationTarget,
        actions: Ints,
        constants: dict[int, int],
        axes: Sequence[SharedAxis],
        tolerances: Sequence[float],
    ) -> Hashable:
        """A value that is equal for trials with equal results."""
        return (
            target,
            actions.tobytes(),
            tuple(constants.values()),
            tuple((axis.keys.tobytes(), axis.members) for axis in axes),
            tuple(self._sizes.storage_level(i, tolerances[i]) for axis in axes for i in axis.members),
        )

    def _single_key(self, actions: Ints, constants: dict[int, int], shown: list[Floats]) -> dict[int, EncodedKeys]:
        """Single keys of constant tracks; writes them and the rest values of dropped tracks to `shown`."""
        for path, rest in enumerate(self._rest):
            gone = np.flatnonzero((actions == TrackAction.DROPPED) & (self._paths == path))
            shown[path][self._nodes[gone]] = rest[gone][:, None]
        keys = {}
        for i, number in constants.items():
            keys[i] = quantization.constant_cost(self._constants[i][number][0])
            shown[self._paths[i]][self._nodes[i]] = keys[i].values[0]
        return keys

    def _chords_matter(self, axes: list[SharedAxis], keys: dict[int, EncodedKeys]) -> bool:
        for axis in axes:
            for i in axis.members:
                if self._paths[i] == ROTATION:
                    gap = playback.arc_distance(playback.steps(keys[i].values).max(initial=0.0)) / 2
                    if gap * self._meters[i] > CHORD_BOUND_FRACTION * self._bound:
                        return True
        return False

    def _nlerp_usage(self, axes: list[SharedAxis], keys: dict[int, EncodedKeys], shown: list[Floats]) -> Floats:
        for axis in axes:
            members = [i for i in axis.members if self._paths[i] == ROTATION]
            if members:
                mixed = self._candidates.by_chords(axis, [keys[i] for i in members])
                shown[ROTATION][self._nodes[members]] = np.swapaxes(mixed, 0, 1)
        return self._usage.nlerp(shown)


def _rest(source: SourceMotion, path: str) -> Floats:
    """The rest values (G, C) of the tracks of a path; 0 for all others."""
    width = next((len(each.rest) for each in source.moving if each.path == path), 1)
    return np.array([each.rest if each.path == path else np.zeros(width) for each in source.moving]).reshape(-1, width)


def _constant_errors(source: SourceMotion, shared: Sequence[Sequence[Floats]]) -> list[list[tuple[Floats, float]]]:
    """For each track the `shared` values with its largest distance from each, in metres; then rest and middle."""
    found: list[list[tuple[Floats, float]]] = [[] for _ in source.moving]
    for path in PATHS:
        pairs = [(i, value) for i, each in enumerate(source.moving) if each.path == path for value in shared[i]]
        if not pairs:
            continue
        tracks = [source.moving[i] for i, _ in pairs]
        moved, values = np.array([each.values for each in tracks]), np.array([value for _, value in pairs])
        if path == "rotation":
            values = np.where(quaternion.dot(moved[:, 0], values)[:, None] < 0, -values, values)
        errors = np.sqrt(farthest(moved, values)) * np.array([each.meters for each in tracks])
        for (i, _), value, error in zip(pairs, values, errors.tolist(), strict=True):
            found[i].append((value, error))
    for constants, each in zip(found, source.moving, strict=True):
        constants += [(each.rest, each.from_rest), (each.middle, each.from_middle)]
    return found


class BoundUsage:
    """Measures a clip played as translation (N, W, 3), rotation (N, W, 4), scale (N, W, 3) of all nodes.

    allowed: (P,) m, error bound of each point.
    """

    def __init__(self, skeleton: Skeleton, source: SourceMotion, allowed: Floats, bounds: Bounds) -> None:
        self.bounds = bounds
        self._skeleton = skeleton
        self._source = source
        self._rows = source.points.rows()
        self._allowed = allowed
        self._blocks = _time_blocks(len(source.at), len(skeleton))
        self._local = local_matrices(skeleton, source.local) if len(self._blocks) == 1 else None
        self._changing = np.array(sorted({each.node for each in source.moving}), np.int64)
        self._nodes = np.array([each.node for each in source.moving], np.int64)
        self._turning = np.array([each.path == "rotation" for each in source.moving], np.bool_)

    def slerp_raw(self, shown: Sequence[Floats]) -> Floats:
        """Return the bound usage of each point (P,) for players with slerp."""
        return self._usage(shown, self._source.columns)

    def nlerp(self, shown: Sequence[Floats]) -> Floats:
        """Return the same for players with component-wise interpolation, against the source played by them."""
        return self._usage(shown, self._source.by_chord)

    def own(self, shown: Sequence[Floats]) -> Floats:
        """Return the fraction of the angle bound that each track (G,) uses: errors of all ancestors add up."""
        own = np.zeros(len(self._nodes))
        if self.bounds.max_angle is None:
            return own
        turned = quaternion.angle_between(shown[ROTATION], self._source.local[ROTATION]).max(axis=1)  # (N,)
        parents = self._skeleton.parents
        for level in self._source.levels[1:]:
            turned[level] += turned[parents[level]]
        for level in reversed(self._source.levels[1:]):
            np.maximum.at(turned, parents[level], turned[level])
        own[self._turning] = turned[self._nodes[self._turning]] / self.bounds.max_angle
        return own

    def _usage(self, shown: Sequence[Floats], columns: Floats) -> Floats:
        found = [self._usage_over(times, shown, columns) for times in self._blocks]
        return found[0] if len(found) == 1 else np.asarray(np.max(found, axis=0))

    def _usage_over(self, times: slice, shown: Sequence[Floats], columns: Floats) -> Floats:
        """The bound usage at some of the measurement times."""
        at = self._source.at[times]
        some = columns.reshape(len(columns), 3, -1)[..., times].reshape(len(columns), -1)
        world = self._world([part[:, times] for part in shown], times)
        moved = self._rows.moves(stack_points(world, self._source.points.nodes) - some)
        usage = _longest(moved) / self._allowed
        if self.bounds.max_speed_error is not None and len(at) > 1:
            gaps = np.maximum(np.diff(at), MIN_INTERVAL_S).astype(np.float32)
            usage = np.maximum(usage, _longest(np.diff(moved, axis=2) / gaps) / self.bounds.max_speed_error)
        return np.asarray(usage, np.float64)

    def _world(self, shown: Sequence[Floats], times: slice) -> Floats:
        """World matrices (N, W, 3, 4); only nodes that a track may change get new local matrices."""
        if self._local is None:
            local = local_matrices(self._skeleton, [part[:, times] for part in self._source.local])
        else:
            local = self._local.copy(order="K")
        changing = self._changing
        local[changing] = matrix.from_trs(*(part[changing] for part in shown))
        return matrix.accumulate_world(local, self._skeleton.parents, list(self._source.levels))


def _time_blocks(times: int, nodes: int) -> list[slice]:
    """Slices of the measurement times, each with one time of the block before, from which speeds are measured."""
    length = max(MAX_BLOCK_MATRICES // max(nodes, 1), MIN_BLOCK_TIMES)
    if times <= length:
        return [slice(None)]
    return [slice(max(first - 1, 0), first + length) for first in range(0, times, length)]


def _longest(moved: Floats) -> Floats:
    """The longest of each row of vectors (P, 3, F)."""
    squares = moved * moved
    return np.asarray(np.sqrt((squares[:, 0] + squares[:, 1] + squares[:, 2]).max(axis=1)))
