"""Joints with non-uniform scale or shear, where tools differ on all methods but lbs."""

from __future__ import annotations

import numpy as np

from anim.arrays import Floats
from anim.model import Clip, Skeleton
from anim.sampling import PoseSampler
from anim.skinning.bake import Baker
from anim.skinning.bound_mesh import BoundMesh
from anim.skinning.weighted_joints import bind_shape

UNEVEN_SCALE = 1e-3  # relative difference of scale factors; rounding in files leaves less
EVEN_SCALE = UNEVEN_SCALE / 10  # the same, that all nodes of a chain together have from rounding
CHUNK_FRAMES = 256  # frames


class UnevenScale:
    """Search for joints of a baker's meshes that scale unevenly or shear, prepared for many clips."""

    def __init__(self, made: Baker) -> None:
        self._skeleton = made.scene.skeleton
        self._meshes = [_WeightedMesh(layer) for layer in made.bind_each()]

    def joints(self, clip: Clip, times: Floats) -> tuple[int, ...]:
        """Return the joints with weight that scale unevenly, or shear, at any of `times` (F,) s, increasing.

        As node indices. A common stretch of all bind matrices of a mesh doesn't count: it is undone before joints move
        the mesh.
        """
        if _scales_evenly(self._skeleton, clip):  # what remains is of the bind matrices, equal at all times
            times = times[:1]
        sampler = PoseSampler(self._skeleton, clip)
        found: set[int] = set()
        for first in range(0, len(times), CHUNK_FRAMES):
            frames = sampler.posed(times[first : first + CHUNK_FRAMES])
            for mesh in self._meshes:
                found |= mesh.uneven(mesh.layer.matrices(frames, slice(None)))
        return tuple(sorted(found))


class _WeightedMesh:
    """A mesh, its joints with weight, and the inverse of its common stretch, None for none."""

    def __init__(self, layer: BoundMesh) -> None:
        shape = bind_shape(layer.rig)
        self.layer, self._used = layer, np.unique(layer.rig.joint)
        self._unstretched = None if shape is None else np.linalg.inv(shape)

    def uneven(self, matrices: Floats) -> set[int]:
        """Return the nodes of uneven joints. matrices: (n, J, 3, 4) of all joints."""
        linear = matrices[:, self._used, :, :3]
        if self._unstretched is not None:
            linear = linear @ self._unstretched
        square = np.swapaxes(linear, -1, -2) @ linear
        even = np.trace(square, axis1=-2, axis2=-1)[..., None, None] / 3 * np.eye(3)
        off = np.abs(square - even).max(axis=(0, 2, 3)) > 2 * UNEVEN_SCALE * even[..., 0, 0].max(axis=0)
        return {int(self.layer.rig.nodes[joint]) for joint in self._used[off]}


def _scales_evenly(skeleton: Skeleton, clip: Clip) -> bool:
    """Return whether every node scales equally along its axes, at rest and in all keys, but for rounding."""
    limit = EVEN_SCALE / max(len(skeleton.levels()), 1)
    scales = [skeleton.scale]
    for track in clip.tracks:
        if track.path == "scale":
            scales += [each for each in (track.values, track.in_tangents, track.out_tangents) if each is not None]
    return all((np.ptp(each, axis=1) <= limit * np.abs(each).max(axis=1)).all() for each in scales)
