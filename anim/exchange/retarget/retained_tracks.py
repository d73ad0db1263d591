"""Tracks retained when a motion replaces a clip: those of nodes that the motion does not animate."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from anim.arrays import Floats
from anim.exchange.retarget.apply import CharacterClip
from anim.exchange.retarget.rest_alignment import Measure
from anim.maths import hierarchy, matrix, quaternion
from anim.model import Clip, Interpolation, Skeleton, TimeAxis, Track
from anim.model.skeleton import nearest_ancestors, node_mask
from anim.sampling import sample_pose
from anim.sampling.times import key_times
from anim.sampling.world import world_by_node

SAME_SCALE = 1e-6  # relative difference of float32 scales by rounding


def retained_tracks(old: Clip, done: CharacterClip) -> tuple[tuple[Track, ...], int]:
    """Return the retained tracks of a replaced clip, and the count of removed ones without a motion node.

    These are tracks of unmatched nodes, of morph weights and of pointers. They are retained if the motion has the
    character's own build; with another one's motion they are removed.
    """
    known = set(done.matching.pairs.values())
    found = tuple(t for t in old.tracks if t.node is None or t.path == "weights" or t.node not in known)
    return (found, 0) if done.measure is Measure.BUILD else ((), len(found))


def scaled_ancestors(done: CharacterClip, stay: Sequence[Track], skeleton: Skeleton) -> list[int]:
    """Return the nodes above matched joints with another scale in the retained tracks than at rest.

    `add_retained_tracks` removes their effect from the joints: a motion such as BVH has no scale.
    """
    known = node_mask(skeleton, done.matching.pairs.values())
    above = hierarchy.with_ancestors(skeleton.parents, known) & ~known
    scales = [(track.node, track.values) for track in stay if track.node is not None and track.path == "scale"]
    return sorted({n for n, v in scales if above[n] and not np.allclose(v, skeleton.scale[n], rtol=SAME_SCALE)})


def add_retained_tracks(done: CharacterClip, stay: Sequence[Track], skeleton: Skeleton) -> Clip:
    """Return the motion's clip with the retained tracks.

    Joints keep their world-space motion below nodes that the retained tracks move.
    """
    moving = {track.node for track in stay if track.path != "weights"}
    known = set(done.matching.pairs.values())
    is_known, is_moving = node_mask(skeleton, known), node_mask(skeleton, moving)
    nearest = nearest_ancestors(skeleton.parents, is_known | is_moving)
    below = [node for node in known if nearest[node] >= 0 and not is_known[nearest[node]]]
    if not below:
        return Clip(done.clip.name, (*done.clip.tracks, *stay))
    times = key_times(np.concatenate([track.times for track in done.clip.tracks]))
    wanted = world_by_node(skeleton, sample_pose(skeleton, done.clip, times))
    world = world_by_node(skeleton, sample_pose(skeleton, Clip("", (*stay, *done.clip.tracks)), times))
    tracks = {(track.node, track.path): track for track in done.clip.tracks}
    axis = TimeAxis(times)
    tops = nearest_ancestors(skeleton.parents, is_known)
    for node in below:
        parent, top = int(skeleton.parents[node]), int(tops[node])
        carried = world[parent]
        if top >= 0:  # world matrix of the parent after its matched joint is restored
            carried = matrix.multiply(matrix.multiply(wanted[top], matrix.inverse(world[top])), carried)
        local = matrix.multiply(matrix.inverse(carried), wanted[node])
        tracks |= {(node, track.path): track for track in _tracks(node, axis, local)}
    return Clip(done.clip.name, (*tracks.values(), *stay))


def _tracks(node: int, axis: TimeAxis, local: Floats) -> Iterator[Track]:
    translation, rotation, scale = matrix.decompose(local)[:3]
    yield Track(node, "translation", Interpolation.LINEAR, axis, translation)
    yield Track(node, "rotation", Interpolation.LINEAR, axis, quaternion.align_signs(rotation))
    yield Track(node, "scale", Interpolation.LINEAR, axis, scale)
