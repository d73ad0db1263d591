"""Blocks of frames of a scene: the input of skinning."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats
from anim.model import Clip, Skeleton
from anim.sampling.pose import PoseSampler, world_by_node


@dataclass(frozen=True, slots=True)
class PoseBlock:
    """F frames at `times` (F,) s: world_from_node (N, F, 3, 4), and animated morph weights (F, M) by node."""

    times: Floats
    world: Floats
    weights: Mapping[int, Floats]

    def part(self, span: slice) -> PoseBlock:
        """Return some of the frames, as views."""
        weights = {node: values[span] for node, values in self.weights.items()}
        return PoseBlock(self.times[span], self.world[:, span], weights)


class PosePlayback:
    """Pose sampler of a clip on a skeleton, prepared once for many time spans."""

    def __init__(self, skeleton: Skeleton, clip: Clip) -> None:
        self._skeleton, self._poses = skeleton, PoseSampler(skeleton, clip)

    def at(self, times: Floats) -> PoseBlock:
        """Return the frames at `times` (F,) in seconds."""
        pose = self._poses.at(times)
        return PoseBlock(pose.times, world_by_node(self._skeleton, pose), pose.weights)


def rest_block(skeleton: Skeleton) -> PoseBlock:
    """Return one frame, of the rest pose."""
    return PosePlayback(skeleton, Clip("", ())).at(np.zeros(1))
