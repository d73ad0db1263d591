"""Root motion of clips."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from typing import Any, NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.maths import hierarchy
from anim.model import Clip, Skeleton
from anim.sampling.clips import sample_world_matrices
from anim.sampling.scene_parts import select_nodes, select_tracks

MIN_DISPLACEMENT_PER_PATH = 0.7
BLOCK_CLIPS = 64  # that are sampled at once


class RootMotion(NamedTuple):
    """Displacement of a clip's root from start to end.

    root: index of the node, −1 if no translation changes. distance: m. speed: m/s.
    """

    root: int
    distance: float
    speed: float


def root_motions(
    skeleton: Skeleton, clips: Sequence[Clip], *, figure: AbstractSet[int] | None = None
) -> list[RootMotion]:
    """Return the RootMotion of each clip; none for clips of zero duration.

    figure: nodes that can be the root, see `figure_nodes`; None for all.
    """
    if not len(skeleton) or not clips:
        return [RootMotion(-1, 0.0, 0.0) for _ in clips]
    ranks = skeleton.derive(_ranks)
    roots = [_root(clip, ranks, figure) if clip.end > clip.start else -1 for clip in clips]
    blocks = (slice(first, first + BLOCK_CLIPS) for first in range(0, len(clips), BLOCK_CLIPS))
    ways = [way for one in blocks for way in _ways(skeleton, clips[one], roots[one])]
    return [_travel(*each) for each in zip(clips, roots, ways, strict=True)]


def _ways(skeleton: Skeleton, clips: Sequence[Clip], roots: Sequence[int]) -> list[Floats]:
    """The displacement (3,) of each clip's root from start to end, m; of a clip without one that of any node.

    Only the roots and the nodes above them are sampled.
    """
    chosen = np.zeros(len(skeleton), np.bool_)
    chosen[[root for root in roots if root >= 0]] = True
    nodes = np.flatnonzero(hierarchy.with_ancestors(skeleton.parents, chosen))
    if not len(nodes):
        return [np.zeros(3)] * len(clips)
    own = [select_tracks(clip, nodes) for clip in clips]
    times = np.array([[clip.start, clip.end] for clip in clips])
    world, _ = sample_world_matrices(select_nodes(skeleton, nodes), own, times)
    places = world[..., 3].reshape(len(nodes), len(clips), 2, 3)
    at = np.searchsorted(nodes, roots)  # 0 without a root
    return [places[root, i, 1] - places[root, i, 0] for i, root in enumerate(at.tolist())]


def figure_nodes(json: Mapping[str, Any], skeleton: Skeleton) -> frozenset[int]:
    """Return the nodes that carry the visible content: the joints of all skins and their ancestors.

    Without skins, the nodes of the default scene; without a default scene, all nodes.
    """
    above = {int(joint) for skin in json.get("skins", ()) for joint in skin["joints"]}
    if above:
        waiting = list(above)
        while waiting:
            parent = int(skeleton.parents[waiting.pop()])
            if parent >= 0 and parent not in above:
                above.add(parent)
                waiting.append(parent)
        return frozenset(above)
    scenes = json.get("scenes", ())
    tops = scenes[json.get("scene", 0)].get("nodes", ()) if scenes else ()
    found = np.zeros(len(skeleton), np.bool_)
    found[list(tops)] = True
    found = hierarchy.with_descendants(skeleton.parents, found)
    return frozenset(np.flatnonzero(found).tolist() or range(len(skeleton)))


def root_motion_node(skeleton: Skeleton, clip: Clip) -> int:
    """Return the index of the node whose translation moves a character along, −1 without one.

    It is the translated node nearest to the root, if it has descendants and its displacement is at least 0.7 of the
    length of its path.
    """
    root = _root(clip, skeleton.derive(_ranks)) if len(skeleton) else -1
    return root if _leads(skeleton, clip, root) else -1


def _leads(skeleton: Skeleton, clip: Clip, root: int) -> bool:
    """Return whether the translation keys of a root have a net displacement, and the root has descendants."""
    if root < 0 or not (skeleton.parents == root).any():
        return False
    path = next(t.values for t in clip.tracks if t.node == root and t.path == "translation")
    steps = np.diff(path, axis=0)
    length = float(np.sqrt((steps * steps).sum(axis=1)).sum())
    return length > 0 and float(np.linalg.norm(path[-1] - path[0])) > MIN_DISPLACEMENT_PER_PATH * length


def _travel(clip: Clip, root: int, away: Floats) -> RootMotion:
    """Root motion of one clip. away: displacement (3,) of the root from start to end."""
    if root < 0:
        return RootMotion(-1, 0.0, 0.0)
    distance = float(np.linalg.norm(away))
    return RootMotion(root, distance, distance / (clip.end - clip.start))


def _root(clip: Clip, ranks: Floats, figure: AbstractSet[int] | None = None) -> int:
    """The translated node nearest to the root of the hierarchy."""
    keys = {track.node: track.values for track in clip.tracks if track.path == "translation" and track.node is not None}
    from_root = sorted(keys if figure is None else keys.keys() & figure, key=ranks.item)
    return next((node for node in from_root if _moves(keys[node])), -1)


def _moves(values: Floats) -> bool:
    """Return whether keys (K, 3) differ; most have equal bytes, which are compared in a tenth of the time."""
    return values.tobytes() != len(values) * values[0].tobytes() and bool((values != values[0]).any())


def _ranks(skeleton: Skeleton) -> Floats:
    """The rank (N,) of each node: those nearest to the root of the hierarchy first, then by index."""
    ranks = np.zeros(len(skeleton))
    ranks[np.concatenate([np.sort(level) for level in skeleton.levels()])] = np.arange(len(skeleton))
    return ranks
