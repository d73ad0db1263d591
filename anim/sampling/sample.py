"""Tables of poses for scripts and plots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from anim.arrays import Floats
from anim.errors import RangeError, check_type
from anim.maths import matrix
from anim.model import Clip, Skeleton
from anim.sampling.pose import sample_pose
from anim.sampling.track import sample as sample_track
from anim.sampling.world import world_matrices

SPACES = ("local", "world")


@dataclass(frozen=True, slots=True, eq=False)
class PoseTable:
    """Transforms of all nodes at F times, in their parents' space or in world space.

    times: (F,) s. translation (F, N, 3) m, rotation (F, N, 4) unit xyzw, scale (F, N, 3); in world space those of
    `world`, which also contains the shear of a rotated node under a non-uniform scale.
    world: world_from_node (F, N, 3, 4), None in local space.
    weights: by node, (F, M). pointers: by JSON pointer, (F, C).
    """

    times: Floats
    translation: Floats
    rotation: Floats
    scale: Floats
    world: Floats | None
    weights: Mapping[int, Floats]
    pointers: Mapping[str, Floats]

    def __repr__(self) -> str:
        space = "local" if self.world is None else "world"
        return f"PoseTable(frames={len(self.times)}, nodes={self.translation.shape[1]}, {space})"


def sample(skeleton: Skeleton, clip: Clip, at: Floats, *, space: str = "local") -> PoseTable:
    """Return the transforms of all nodes at times `at` (F,) s; outside the clip those of its nearest end.

    space: "local", in the parent's space, or "world". Raises RangeError for another.
    Raises NotFoundError for a track of a node that the skeleton lacks, ShapeError or RangeError for bad times.
    """
    check_type(skeleton, Skeleton, "skeleton")
    check_type(clip, Clip, "clip")
    if space not in SPACES:
        raise RangeError(f"`space` is '{space}' (expected local or world)")
    local = sample_pose(skeleton, clip, at)
    pointers = {
        track.pointer: sample_track(track, at)
        for track in clip.tracks
        if track.node is None and track.pointer is not None
    }
    if space == "local":
        parts = (local.translation, local.rotation, local.scale)
        return PoseTable(local.times, *parts, None, local.weights, pointers)
    world = world_matrices(skeleton, local)
    translation, rotation, scale, _ = matrix.decompose(world)
    return PoseTable(local.times, translation, rotation, scale, world, local.weights, pointers)
