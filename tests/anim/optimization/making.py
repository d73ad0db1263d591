"""A scene, its clips, and what an optimization of them starts from."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats
from anim.measure.error.point_matrix import PointMatrix, sample_points
from anim.model import Clip, Scene
from anim.optimization.clip import Task, solve
from anim.optimization.options import Bounds, Objective, Packing, Policy, Reference, find_effort
from anim.optimization.search.answering_points import AnsweringPoints
from anim.optimization.search.context import Context, build_context
from anim.optimization.search.long_clips import search_all
from anim.optimization.search.plan import FoundKeys, Solution
from anim.optimization.search.source_analysis import FreeTracks, analyze_sources
from anim.optimization.search.source_motion import SourceMotion
from anim.optimization.tracks.quantization import BYTE_COSTS, Encoding
from tests.anim.skinning.scenes import random_scene
from tests.clips import about, clip, track

CORE = Encoding(Packing.CORE, BYTE_COSTS[Objective.FILE])
JOINTS = 5
TIMES = np.linspace(0, 2, 25)  # s
SHORT_TIMES = np.arange(9) / 16  # s
LATE_TIMES = np.arange(43) / 16 + 0.5  # s


def scene(seed: int = 1, **more: float) -> Scene:
    """A skinned tree of five joints with 60 vertices; its mesh hangs on node 5."""
    return random_scene(seed, joints=JOINTS, vertices=60, **more)


def turning(amount: float, axis: Sequence[float] = (0, 0, 1), times: Floats = TIMES) -> Floats:
    """Quaternions (K, 4) that swing by `amount` rad about an axis, once there and back, to the bit."""
    half = amount * np.sin(np.pi * times / times[-1]) / 2
    half[-1] = half[0]
    direction = np.asarray(axis, float) / np.linalg.norm(axis)
    return np.concatenate((np.sin(half)[:, None] * direction, np.cos(half)[:, None]), axis=1)


def waving(name: str = "wave", times: Floats = TIMES) -> Clip:
    """A clip in which joints 1 and 2 turn and the root sways; joint 3 is held where it rests, joint 4 elsewhere."""
    sway = np.stack((np.sin(3 * times), 0 * times, np.cos(times)), axis=1)
    return clip(
        track("translation", times, sway, node=0),
        track("rotation", times, turning(1.5, times=times), node=1),
        track("rotation", times, turning(-0.8, (1, 2, 0), times), node=2),
        track("scale", times, np.ones((len(times), 3)), node=3),
        track("scale", times, np.full((len(times), 3), 0.75), node=4),
        name=name,
    )


def nodding(name: str = "nod", times: Floats = SHORT_TIMES) -> Clip:
    """A clip of other tracks: joint 3 turns and grows, joint 1 turns too, in fewer keys and without coming back."""
    there = times / times[-1]
    return clip(
        track("rotation", times, about("x", 70 * there**2), node=3),
        track("scale", times, 1 + np.outer(np.sin(4 * there), [0.1, 0.2, 0.1]), node=3),
        track("rotation", times[::2], about("y", 40 * np.cos(5 * there[::2])), node=1),
        name=name,
    )


def stepping(name: str = "step", times: Floats = LATE_TIMES) -> Clip:
    """A longer clip, which starts later: the root turns, joint 2 moves, joint 4 turns noisily."""
    noise = np.random.default_rng(5).normal(0, 3, len(times))
    path = np.stack((times, np.abs(np.sin(4 * times)), 0 * times), axis=1)
    return clip(
        track("rotation", times, about("y", 60 * np.sin(times)), node=0),
        track("translation", times, 0.3 * path, node=2),
        track("rotation", times, about("z", 20 * np.sin(6 * times) + noise), node=4),
        name=name,
    )


def task_of(what: Clip, bound: float, *, unused: bool = False) -> Task:
    """A clip to optimize, without constants of other clips."""
    count = len(what.tracks)
    return Task(what, ((),) * count, (unused,) * count, bound)


def solved(context: Context, task: Task) -> Solution | None:
    """The solution of a clip by itself: each of its searches is run alone."""
    steps = solve(context, task)
    answer: FoundKeys | None = None
    while True:
        try:
            request = steps.send(answer)
        except StopIteration as end:
            solution: Solution | None = end.value
            return solution
        (answer,) = search_all(context, [request], context.effort)


def every_point(of: Scene) -> PointMatrix:
    """All vertices of a scene as measured points."""
    count = len(of.instances[0].mesh.positions)
    return sample_points(of, frozenset(), 0.01, frozenset((0, v) for v in range(count)))


def truth_of(
    of: Scene,
    what: Clip,
    points: PointMatrix,
    reference: Reference = Reference.CURVE,
    free: Sequence[int] | None = None,
) -> SourceMotion:
    """What a clip does to points. free: indices of the tracks that may change; all by default."""
    below = AnsweringPoints(points, of.skeleton.parents)
    free = range(len(what.tracks)) if free is None else free
    (found,) = analyze_sources(of.skeleton, [FreeTracks(what, free, 1e-6)], points, below, reference=reference)
    return found


def setting_of(
    of: Scene,
    clips: Sequence[Clip],
    *,
    max_error: float = 1e-3,
    policy: Policy | None = None,
    effort: str = "fast",
    packing: Packing = Packing.CORE,
    bounds: Bounds | None = None,
) -> Context:
    """The setting for clips of a scene."""
    return build_context(
        of,
        tuple(clips),
        bounds=bounds or Bounds(max_error, 0.02),
        policy=policy or Policy(),
        coding=Encoding(packing, BYTE_COSTS[Objective.FILE]),
        effort=find_effort(effort, packing),
    )
