"""Error of new joints and weights: the largest distance of the vertices that have others."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix
from anim.measure.error.metric import ErrorMetric
from anim.measure.error.sample_times import dense_times
from anim.measure.error.surface import Surface, morph_points, skin_points, surfaces
from anim.model import Clip
from anim.sampling.pose import PosedSkeleton

SAME_WEIGHT = 1e-9  # smaller differences are rounding of sums
Pair = tuple[Surface, Surface]


def influence_error(metric: ErrorMetric, clips: Sequence[tuple[Clip, Clip]]) -> float:
    """Return the largest distance in m, 0 if all influences are the same. clips: before and after, in pairs.

    The metric moves the first scene's vertices by the weights of that scene, and doesn't see other weights. Meshes
    on the same node have the same vertices in the same order.
    """
    pairs = list(_changed(metric))
    error = 0.0
    for before, after in clips if pairs else ():
        for block in metric.blocks(before, after, dense_times(before, after)):
            for old, new in pairs:
                placed = zip(_placed(old, block.old), _placed(new, block.new), strict=True)
                error = max(error, *(float(np.linalg.norm(a - b, axis=1).max()) for a, b in placed))
    return error


def _changed(metric: ErrorMetric) -> Iterator[Pair]:
    """Yield the vertices with other influences, as both scenes have them."""
    others = {each.owner: each for each in surfaces(metric.other)}
    for old in surfaces(metric.scene):
        new = others.get(old.owner)
        if new is not None and len(old.points) == len(new.points):
            vertices = _different(old, new)
            if len(vertices):
                yield _part(old, vertices), _part(new, vertices)


def _different(old: Surface, new: Surface) -> Ints:
    """Indices of the vertices with another weight on any node."""
    nodes = [each.nodes[each.joints] for each in (old, new)]
    if np.array_equal(nodes[0], nodes[1]) and np.array_equal(old.weights, new.weights):
        return np.empty(0, np.int64)
    count = max(int(each.max(initial=0)) for each in nodes) + 1
    vertices = np.arange(len(old.points))[:, None]
    keys, pairs = np.unique(np.concatenate([(vertices * count + n).ravel() for n in nodes]), return_inverse=True)
    differences = np.bincount(pairs.ravel(), np.concatenate((old.weights.ravel(), -new.weights.ravel())))
    return np.unique(keys[np.abs(differences) > SAME_WEIGHT] // count)


def _part(surface: Surface, vertices: Ints) -> Surface:
    """The surface with some of its vertices."""
    return surface._replace(
        points=surface.points[vertices],
        targets=surface.targets[:, vertices],
        joints=surface.joints[vertices],
        weights=surface.weights[vertices],
    )


def _placed(surface: Surface, posed: PosedSkeleton) -> Iterator[Floats]:
    """Yield the vertices (V, 3) in world space at each time."""
    weights = posed.weights.get(surface.owner)
    for i, world in enumerate(np.swapaxes(posed.of(surface.nodes), 0, 1)):
        morph = surface.rest_weights if weights is None else weights[i]
        yield skin_points(surface, morph_points(surface, morph[None])[0], matrix.multiply(world, surface.bind))
