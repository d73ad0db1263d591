"""Largest elongation of a cloth at every step: of free edges, and of those with a pinned end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from anim.arrays import Floats, Ints
from anim.simulation.cloth.model import ClothModel

FREE, ATTACHED = 0, 1  # columns of `find_longest`


@dataclass(frozen=True, slots=True, eq=False)
class FrameElongation:
    """Largest relative elongation of the steps that end with a frame: of free and attached edges.

    fractions: (2,). edges: (2,) indices. ages: (2,) s from the step to the frame.
    """

    fractions: Floats
    edges: Ints
    ages: Floats

    @property
    def largest(self) -> float:
        """The larger of both fractions."""
        return float(self.fractions.max())


@dataclass(frozen=True, slots=True)
class ElongationRecord:
    """Largest elongation at the steps of each frame that was simulated."""

    frames: list[FrameElongation] = field(default_factory=list)

    def start(self, model: ClothModel, positions: Floats) -> None:
        """Add the frame that a run begins with."""
        self.frames.append(measure_elongation(model, positions))

    def add(self, edges: Ints, elongation: Floats, step: float) -> None:
        """Add a frame whose S steps end with edges and elongations (S, 2) of `find_longest`. step: s."""
        worst, kinds = elongation.argmax(axis=0), np.arange(2)
        ages = (len(elongation) - 1 - worst) * step
        self.frames.append(FrameElongation(elongation[worst, kinds], edges[worst, kinds], ages))

    def join(self, steps: Sequence[FrameElongation], step: float) -> None:
        """Add a frame of steps that were measured one by one."""
        self.add(np.array([each.edges for each in steps]), np.array([each.fractions for each in steps]), step)


def measure_elongation(model: ClothModel, positions: Floats) -> FrameElongation:
    """Return the largest elongation of points (P, 3)."""
    from anim.simulation.cloth.kernels.constraints import find_longest

    edges, elongation = np.zeros(2, np.int64), np.empty(2)
    x = np.ascontiguousarray(positions)
    find_longest(x, model.inverse_masses, model.topology.edges, model.edge_lengths, edges, elongation)
    return FrameElongation(elongation, edges, np.zeros(2))


def join_elongations(a: FrameElongation, b: FrameElongation) -> FrameElongation:
    """Return the larger of both for free and for attached edges."""
    first = a.fractions >= b.fractions
    columns = ((a.fractions, b.fractions), (a.edges, b.edges), (a.ages, b.ages))
    return FrameElongation(*(np.where(first, of_a, of_b) for of_a, of_b in columns))


def attachment_elongation(model: ClothModel, frames: Floats) -> float:
    """Return the elongation that the animation alone forces in frames (F, P, 3).

    A free point between two pinned ones that move apart can't be nearer to both than half their distance.
    """
    edges, pinned = model.topology.edges, model.inverse_masses == 0
    attached = np.flatnonzero(pinned[edges].sum(axis=1) == 1)
    is_first = pinned[edges[attached, 0]]
    anchor = np.where(is_first, edges[attached, 0], edges[attached, 1])
    free = np.where(is_first, edges[attached, 1], edges[attached, 0])
    order = np.argsort(free, kind="stable")
    anchor, free, lengths = anchor[order], free[order], model.edge_lengths[attached][order]
    largest = 0.0
    for offset in range(1, int(np.bincount(free).max(initial=0))):
        a = np.flatnonzero(free[offset:] == free[:-offset])
        b = a + offset
        apart = np.linalg.norm(frames[:, anchor[a]] - frames[:, anchor[b]], axis=2).max(axis=0, initial=0.0)
        largest = max(largest, float((apart / (lengths[a] + lengths[b])).max(initial=1.0)) - 1)
    return largest
