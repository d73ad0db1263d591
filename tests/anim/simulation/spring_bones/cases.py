"""Files with spring bones, and a root that sways, for several tests."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from anim.arrays import Floats
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.maths import quaternion
from anim.model import Clip, Skeleton, Track
from anim.simulation.spring_bones.chains import SpringBones
from anim.simulation.spring_bones.read import read_spring_bones
from anim.simulation.spring_bones.solver import SpringMotion, SpringSolver
from tests.anim.simulation.spring_bones import plain_loop
from tests.clips import LINEAR

STEP = 1 / 60
ROOT = 0


@dataclass(frozen=True)
class Case:
    """A file, and the positions (F, 3) and rotations (F, 4) of its root at every step.

    others: further translations (F, 3) and scales (F, 3) of nodes, by node and path.
    """

    document: Document
    positions: Floats
    rotations: Floats
    step: float = STEP
    others: Mapping[tuple[int, str], Floats] = field(default_factory=dict)

    @property
    def skeleton(self) -> Skeleton:
        return reader.skeleton(self.document)

    @property
    def bones(self) -> SpringBones:
        return read_spring_bones(self.document)

    @property
    def times(self) -> Floats:
        return self.step * np.arange(float(len(self.positions)))

    @property
    def clip(self) -> Clip:
        keyed = {(ROOT, "translation"): self.positions, (ROOT, "rotation"): self.rotations, **self.others}
        return Clip("sway", tuple(Track(node, path, LINEAR, self.times, v) for (node, path), v in keyed.items()))

    def simulate(self) -> SpringMotion:
        """Return our motion at the times of all steps."""
        solver = SpringSolver(self.skeleton, self.clip, self.bones, step=self.step)
        solver.start(0.0)
        return solver.run(self.times)

    def plain(self, *, faults: bool) -> tuple[list[int], Floats]:
        """Return the joints and their rotations by the plain loop."""

        def pose(rig: plain_loop.Rig, frame: int) -> None:
            rig.positions[ROOT], rig.rotations[ROOT] = self.positions[frame], self.rotations[frame]
            for (node, path), values in self.others.items():
                (rig.positions if path == "translation" else rig.scales)[node] = values[frame]

        return plain_loop.simulate(self.document.json, pose, len(self.positions), self.step, faults=faults)


def swaying(document: Document, num_frames: int = 241) -> Case:
    """Return a case whose root moves sideways and up by 20 and 5 cm, and turns by 34°."""
    skeleton = reader.skeleton(document)
    times = np.arange(num_frames) * STEP
    none = 0 * times
    way = np.stack([0.2 * np.sin(2 * np.pi * times), 0.05 * np.sin(4 * np.pi * times), none], axis=-1)
    turn = quaternion.from_rotation_vector(np.stack([none, 0.6 * np.sin(1.4 * np.pi * times), none], axis=-1))
    return Case(document, skeleton.translation[ROOT] + way, quaternion.multiply(turn, skeleton.rotation[ROOT]))


def chord(nodes: tuple[int, ...], ours: Floats, other_nodes: list[int], theirs: Floats) -> float:
    """Return the largest difference of a component of two motions (F, J, 4), whatever the signs."""
    theirs = theirs[:, [other_nodes.index(node) for node in nodes]]
    return float(np.minimum(np.abs(ours - theirs).max(axis=-1), np.abs(ours + theirs).max(axis=-1)).max())
