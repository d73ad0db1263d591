"""Error of tracks that move nothing: colors, factors, other JSON pointers, and morph weights that move no vertex."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.model import Clip, Scene, Track, ValueKind
from anim.sampling.track import sample


def pointer_error(before: Clip, after: Clip, times: Floats) -> tuple[float, str]:
    """Return the largest error of such tracks as a fraction of the old range, and the track's pointer.

    Of a constant track the range is its size, of one at 0 the new track's. Tracks of only one of the clips don't count.
    times: (F,) s.
    """
    worst, where = 0.0, ""
    new = {track.target: track for track in after.tracks if track.path == "pointer"}
    for track in before.tracks:
        if track.path != "pointer" or track.target not in new:
            continue
        size = _relative_difference(track, new[track.target], times)
        if size > worst:
            worst, where = size, track.pointer or ""
    return worst, where


def still_weight_error(
    before: Clip, after: Clip, times: Floats, partners: Ints, find_still: Callable[[int], Bools]
) -> tuple[float, int]:
    """Return the largest error of morph weights that move no vertex, as a fraction of each one's range, and its node.

    Such targets have normals, tangents or colors only. partners: (N,) for each node its index in the second scene.
    find_still: the mask (M,) of such weights of a node. times: (F,) s. The node is −1 without an error.
    """
    worst, where = 0.0, -1
    for track, other in _pair_weights(before, after, partners):
        assert track.node is not None
        still = find_still(track.node)
        if len(still) != track.values.shape[1] or not still.any():
            continue
        a, b = sample(track, times)[:, still], sample(other, times)[:, still]
        size = max(_fraction_of_range(a[:, i : i + 1], b[:, i : i + 1]) for i in range(a.shape[1]))
        if size > worst:
            worst, where = size, track.node
    return worst, where


def find_still_weights(scene: Scene) -> Callable[[int], Bools]:
    """Return a function that gives the mask (M,) of the morph weights of a node that move no vertex.

    It is empty without morph targets.
    """
    meshes = {each.node: each.mesh for each in reversed(scene.instances)}

    @cache
    def of_node(node: int) -> Bools:
        targets = meshes[node].targets if node in meshes else np.empty((0, 0, 3))
        return np.asarray(~targets.any(axis=(1, 2)))

    return of_node


def _pair_weights(before: Clip, after: Clip, partners: Ints) -> Iterator[tuple[Track, Track]]:
    """Tracks of weights of the same node in both clips that differ."""
    new = {track.node: track for track in after.tracks if track.path == "weights"}
    for track in before.tracks:
        if track.path != "weights" or track.node is None:
            continue
        other = new.get(int(partners[track.node]))
        if other is not None and other is not track and other.values.shape[1] == track.values.shape[1]:
            yield track, other


def _relative_difference(old: Track, new: Track, times: Floats) -> float:
    a, b = sample(old, times), sample(new, times)
    if old.kind is ValueKind.ROTATION:
        return float(np.minimum(np.abs(a - b).max(axis=1), np.abs(a + b).max(axis=1)).max())
    return _fraction_of_range(a, b)


def _fraction_of_range(old: Floats, new: Floats) -> float:
    """The largest difference of values (F, C) as a fraction of the range of the old ones."""
    extents = (size for values in (old, new) for size in (np.ptp(values, axis=0).max(), np.abs(values).max()))
    return float(np.abs(old - new).max()) / next((float(extent) for extent in extents if extent > 0), 1.0)
