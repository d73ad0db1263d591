"""Motion that drives springs: transforms of the nodes that they depend on, at every step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix
from anim.model import Clip, Pose, Skeleton
from anim.sampling.pose import PoseSampler
from anim.sampling.world import local_by_node


@dataclass(frozen=True, slots=True)
class DriverChunk:
    """Driver at F consecutive steps.

    pose: local transforms of all nodes, springs at rest. local: (N, F, 3, 4) the same as matrices.
    world: (F, D, 3, 4) world matrices of the driven nodes.
    """

    pose: Pose
    local: Floats
    world: Floats


class Driver:
    """Sampler of the driving clip; rotation tracks of spring joints are ignored.

    driven: (D,) nodes that no spring moves, parents first.
    """

    def __init__(self, skeleton: Skeleton, clip: Clip, joints: frozenset[int], driven: Ints) -> None:
        tracks = (
            track
            for track in clip.tracks
            if track.path in ("translation", "rotation", "scale")
            and not (track.path == "rotation" and track.node in joints)
        )
        self._skeleton = skeleton
        self._sampler = PoseSampler(skeleton, Clip(clip.name, tuple(tracks)))
        self._driven = driven

    def at(self, times: Floats) -> DriverChunk:
        """Return the driver at times (F,) in seconds."""
        pose = self._sampler.at(times)
        local = local_by_node(self._skeleton, pose)
        world = np.empty((len(times), len(self._driven), 3, 4))
        row = {int(node): i for i, node in enumerate(self._driven)}
        for node, i in row.items():
            parent = int(self._skeleton.parents[node])
            world[:, i] = local[node] if parent < 0 else matrix.multiply(world[:, row[parent]], local[node])
        return DriverChunk(pose, local, world)
