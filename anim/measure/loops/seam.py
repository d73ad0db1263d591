"""Loop gap and velocity gap of time ranges, as they are visible on the skin."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats, Ints
from anim.measure.loops import clip_ends
from anim.measure.loops.clip_ends import EndPoses, LoopRange
from anim.measure.loops.skin_motion import SkinMotion, longest_each, morphed_vertices
from anim.sampling.batch import ConcatenatedTracks


class Seam(NamedTuple):
    """Maximum over all vertices of the difference between end and start.

    gap: m. speed: m/s, the change of velocity without STEP tracks, and the joint at it (fastest, "" without a change).
    frame: m, the motion per frame next to the gap. going_on: m, the distance of the start from the extrapolated end.
    """

    gap: float = 0.0
    speed: float = 0.0
    fastest: str = ""
    frame: float = 0.0
    going_on: float = 0.0


def measure_seams(
    skin: SkinMotion, parts: Sequence[LoopRange], groups: Sequence[ConcatenatedTracks] | None = None
) -> list[Seam]:
    """Return the difference between the end of each range and its start, in pose and velocity.

    groups: the tracks of all clips from `concatenate`, if the caller has them.
    """
    if not parts or not len(skin.vertices):
        return [Seam() for _ in parts]
    has_frame = any(part.frame for part in parts)
    wanted = clip_ends.DIFFERENCES if has_frame else clip_ends.WITHOUT_FRAME
    count, most = skin.batch_size(len(wanted)), skin.posed_at_once(wanted.shape[1])
    found: list[Seam] = []
    for start in range(0, len(parts), most):
        some = parts[start : start + most]
        own = groups if len(some) == len(parts) else None
        seen = clip_ends.poses_around_ends(skin.skeleton, some, own, has_frame=has_frame)
        for first in range(0, len(some), count):
            found += _seams(skin, seen[first : first + count], some[first : first + count], wanted)
    return found


def _seams(skin: SkinMotion, seen: Sequence[EndPoses], parts: Sequence[LoopRange], wanted: Floats) -> list[Seam]:
    """wanted: (D, T), DIFFERENCES or WITHOUT_FRAME."""

    def differences(nodes: Ints) -> Floats:
        worlds = np.stack([each.world[nodes] for each in seen], axis=1)  # (J, parts, T, 3, 4)
        return clip_ends.differences(worlds, 2, wanted).reshape(len(nodes), -1, 3, 4)

    squares = skin.squares(differences).reshape(len(skin.vertices), len(seen), -1)
    morphing = [skin.exclude_morphing(squares[:, i], each.weights) for i, each in enumerate(seen)]
    most = np.sqrt(squares.max(axis=0)).astype(np.float64)  # (parts, D): of all ranges at once
    points = squares[..., clip_ends.VELOCITY].argmax(axis=0)
    found = []
    for i, (each, part) in enumerate(zip(seen, parts, strict=True)):
        fastest, lengths = _carrier(skin, int(points[i])), most[i]
        for mesh in morphing[i]:
            moved = longest_each(clip_ends.differences(morphed_vertices(mesh, each), 0, wanted))
            if moved[clip_ends.VELOCITY] > lengths[clip_ends.VELOCITY]:
                fastest = skin.skeleton.display_name(mesh.owner)
            lengths = np.maximum(lengths, moved)
        found.append(_seam(lengths, fastest, part))
    return found


def _seam(most: Floats, fastest: str, part: LoopRange) -> Seam:
    """most: (D,), the largest length of each difference. fastest: the node with the largest change of velocity."""
    gap, speed, *of_frames = most.tolist()
    second, last, going_on = of_frames or (0.0, 0.0, gap)
    speed = speed / (part.probe - part.shortest) if part.end > part.start else 0.0
    return Seam(gap, speed, fastest if speed else "", max(second, last), going_on)


def _carrier(skin: SkinMotion, point: int) -> str:
    """Name of the node with the largest weight at a point."""
    vertices = skin.vertices
    most = vertices.factors[point, :, 3].argmax()
    return skin.skeleton.display_name(int(vertices.nodes[vertices.joints[point, most]]))
