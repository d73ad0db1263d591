"""Searches of large scenes on the nodes that their clips move: the points of all others follow the nearest of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from anim.measure.error.reduced_skeleton import reduce_skeletons
from anim.optimization.search.answering_points import AnsweringPoints
from anim.optimization.search.context import Context
from anim.optimization.search.lockstep import SearchRequest
from anim.sampling.pose import rest_world


def reduce_context(context: Context, requests: Sequence[SearchRequest]) -> tuple[Context, list[SearchRequest]]:
    """Return the context and the requests of a search on a skeleton without the nodes that no clip of them moves.

    Both unchanged if the skeleton is small, mostly moves, or has morph targets. Results name tracks, no nodes; they are
    the same but for rounding, and of long clips, which are searched in fewer parts. The new context is for searches
    only: `invisible` and `policy` are those of all nodes.
    """
    skeleton = context.skeleton
    reduced = None
    if not context.surfaces:
        reduced = reduce_skeletons(skeleton, skeleton, [each.clip for each in requests], ())
    if reduced is None:
        return context, list(requests)
    points, moving = context.points.rebind(reduced.anchors[:-1], reduced.offsets[:-1]), reduced.versions[0]
    answering = AnsweringPoints(points, moving.parents)
    smaller = replace(context, skeleton=moving, rest_world=rest_world(moving), points=points, answering=answering)
    return smaller, [each._replace(clip=reduced.clip(each.clip)) for each in requests]
