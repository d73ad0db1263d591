"""Bounds of the second derivative of displacements, from majorants of the points' nodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.measure.continuous_bound.derivative_bounds import product, resting
from anim.measure.continuous_bound.endpoints import endpoints, slide_bounds
from anim.measure.continuous_bound.influence_radius import InfluenceRadius, Morphing
from anim.measure.continuous_bound.node_bounds import NodeBounds
from anim.measure.continuous_bound.node_tracks import ClipSpan, NodeTracks


class SecondDerivativeBound(NamedTuple):
    """Bounds for points of C groups in G intervals, each (C, G).

    bend: m/s², the second derivative of the displacement. jump: m, its jump at the interval's end.
    """

    bend: Floats
    jump: Floats


def second_derivative_bound(of: InfluenceRadius, nodes: NodeBounds, spans: Sequence[ClipSpan]) -> SecondDerivativeBound:
    """Return bounds of the second derivative and jumps of displacements. nodes: in the world."""
    points = resting(of.arms, of.apart)[..., None]
    if of.morphing is not None:
        points = points + _morphed(of.morphing, spans)
    moved = nodes.origins[:, :, of.nodes] + product(nodes.matrices[:, :, of.nodes], points)
    jump = nodes.jumps[1, of.nodes] + nodes.jumps[0, of.nodes] * points[0, 1]
    return SecondDerivativeBound(
        *(_by_group(of.fraction[:, None] * each, of) for each in (moved[2, 1] - moved[2, 0], jump))
    )


def _morphed(of: Morphing, spans: Sequence[ClipSpan]) -> Floats:
    """Majorants (3, 2, J, G) of the displacement of points by weights in the spaces of joints."""
    first, second = (
        endpoints(
            [
                NodeTracks(np.array([owner]), rest[None], each.versions[k].weights(owner, len(rest)), each.where)
                for each in spans
            ]
        )
        for k, (owner, rest) in enumerate(zip(of.owners, of.rest, strict=True))
    )
    lengths = np.concatenate([each.where.lengths for each in spans])
    return np.asarray(of.targets @ slide_bounds(first, second, lengths, np.abs))  # from weights (3, 2, M, G)


def _by_group(bounds: Floats, of: InfluenceRadius) -> Floats:
    """Bounds of groups (C, G) from bounds of joints (J, G): the largest of those with influence."""
    starts = np.cumsum([0, *map(len, of.groups[:-1])])
    return np.asarray(np.maximum.reduceat(bounds[np.concatenate(of.groups)], starts, axis=0))
