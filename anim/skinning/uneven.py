"""Joints with non-uniform scale or shear, where tools differ on all methods but lbs."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.model import Clip
from anim.skinning.bake import Baker
from anim.skinning.bound_mesh import BoundMesh
from anim.skinning.pose_blocks import PosePlayback
from anim.skinning.weighted_joints import bind_shape

UNEVEN_SCALE = 1e-3  # relative difference of scale factors; rounding in files leaves less
CHUNK_FRAMES = 256  # frames


def uneven_joints(made: Baker, clip: Clip, times: Floats) -> tuple[int, ...]:
    """Return the joints with weight that scale unevenly, or shear, at any of `times` (F,) s, increasing.

    As node indices. A common stretch of all bind matrices of a mesh doesn't count: it is undone before joints move the
    mesh.
    """
    playback = PosePlayback(made.scene.skeleton, clip)
    found: set[int] = set()
    for first in range(0, len(times), CHUNK_FRAMES):
        frames = playback.at(times[first : first + CHUNK_FRAMES])
        for layer in made.layers:
            found |= _uneven(layer, layer.matrices(frames, slice(None)))
    return tuple(sorted(found))


def _uneven(layer: BoundMesh, matrices: Floats) -> set[int]:
    """The same of one mesh. matrices: (n, J, 3, 4) of its joints."""
    used = np.unique(layer.rig.joint)
    linear, shape = matrices[:, used, :, :3], bind_shape(layer.rig)
    if shape is not None:
        linear = linear @ np.linalg.inv(shape)
    square = np.swapaxes(linear, -1, -2) @ linear
    even = np.trace(square, axis1=-2, axis2=-1)[..., None, None] / 3 * np.eye(3)
    off = np.abs(square - even).max(axis=(0, 2, 3)) > 2 * UNEVEN_SCALE * even[..., 0, 0].max(axis=0)
    return {int(layer.rig.nodes[joint]) for joint in used[off]}
