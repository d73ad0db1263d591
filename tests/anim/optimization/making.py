"""A scene, its clips, and what an optimization of them starts from."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anim.arrays import Floats
from anim.measure.error.point_matrix import PointMatrix, sample_points
from anim.model import Clip, Scene
from anim.optimization.options import EFFORTS, Bounds, Objective, Packing, Policy, Reference
from anim.optimization.search.answering_points import AnsweringPoints
from anim.optimization.search.context import Context, build_context
from anim.optimization.search.source_motion import SourceMotion, analyze_source
from anim.optimization.tracks.quantization import BYTE_COSTS, Encoding
from tests.anim.skinning.scenes import random_scene
from tests.clips import clip, track

CORE = Encoding(Packing.CORE, BYTE_COSTS[Objective.FILE])
JOINTS = 5
TIMES = np.linspace(0, 2, 25)  # s


def scene(seed: int = 1, **more: float) -> Scene:
    """A skinned tree of five joints with 60 vertices; its mesh hangs on node 5."""
    return random_scene(seed, joints=JOINTS, vertices=60, **more)


def turning(amount: float, axis: Sequence[float] = (0, 0, 1), times: Floats = TIMES) -> Floats:
    """Quaternions (K, 4) that swing by `amount` rad about an axis, once there and back, to the bit."""
    half = amount * np.sin(np.pi * times / times[-1]) / 2
    half[-1] = half[0]
    direction = np.asarray(axis, float) / np.linalg.norm(axis)
    return np.concatenate((np.sin(half)[:, None] * direction, np.cos(half)[:, None]), axis=1)


def waving(name: str = "wave") -> Clip:
    """A clip in which joints 1 and 2 turn and the root sways; joint 3 is held where it rests, joint 4 elsewhere."""
    sway = np.stack((np.sin(3 * TIMES), 0 * TIMES, np.cos(TIMES)), axis=1)
    return clip(
        track("translation", TIMES, sway, node=0),
        track("rotation", TIMES, turning(1.5), node=1),
        track("rotation", TIMES, turning(-0.8, (1, 2, 0)), node=2),
        track("scale", TIMES, np.ones((25, 3)), node=3),
        track("scale", TIMES, np.full((25, 3), 0.75), node=4),
        name=name,
    )


def every_point(of: Scene) -> PointMatrix:
    """All vertices of a scene as measured points."""
    count = len(of.instances[0].mesh.positions)
    return sample_points(of, frozenset(), 0.01, frozenset((0, v) for v in range(count)))


def truth_of(of: Scene, what: Clip, points: PointMatrix, reference: Reference = Reference.CURVE) -> SourceMotion:
    """What a clip does to points, all of its tracks free."""
    below = AnsweringPoints(points, of.skeleton.parents)
    return analyze_source(
        of.skeleton, what, range(len(what.tracks)), points, below, reference=reference, chord_tolerance=1e-6
    )


def setting_of(
    of: Scene,
    clips: Sequence[Clip],
    *,
    max_error: float = 1e-3,
    policy: Policy | None = None,
    effort: str = "fast",
    packing: Packing = Packing.CORE,
) -> Context:
    """The setting for clips of a scene."""
    return build_context(
        of,
        tuple(clips),
        bounds=Bounds(max_error, 0.02),
        policy=policy or Policy(),
        coding=Encoding(packing, BYTE_COSTS[Objective.FILE]),
        effort=EFFORTS[effort],
    )
