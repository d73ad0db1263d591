"""Bind pose of skins, for files with nodes resting in another pose."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from anim.arrays import Floats, Ints
from anim.maths import matrix, quaternion
from anim.model import Clip, Interpolation, Skeleton, Skin, TimeAxis, Track
from anim.sampling import rest_world

MIN_OFFSET_FRACTION = 1e-3  # minimum offset of a joint from its bind position, as a fraction of the joints' size
MIN_ANGLE_RAD = np.radians(1)
SCALE_TOLERANCE = 0.01  # fraction by which two scales may differ; matrices of joints with another scale are ignored


@dataclass(frozen=True, slots=True)
class BindPose:
    """A skeleton resting in its bind pose. num_joints: count of joints that rest elsewhere in the file."""

    skeleton: Skeleton
    num_joints: int


def bind_pose(skeleton: Skeleton, skins: Sequence[tuple[int, Skin]]) -> BindPose:
    """Return the skeleton in the pose of the inverse bind matrices; unchanged if it rests there already.

    The matrices define the joints relative to each other, not the position of the whole: that is taken from the mesh's
    node, a node above the joints, or the world, whichever gives joints nearest to the nodes' pose, and the size is
    kept. Other nodes, and joints with a matrix of another scale than the others', keep their local transform.
    skins: by the node of the mesh, see `reader.skins`.
    """
    world = rest_world(skeleton)
    bound: dict[int, Floats] = {}
    for holder, skin in skins:
        for node, place in _bind_matrices(skeleton, world, (holder, skin), bound).items():
            bound.setdefault(node, place)
    moved = _count_moved(world, bound)
    return BindPose(_set_rest(skeleton, world, bound), moved) if moved else BindPose(skeleton, 0)


def fill_from_parents(clip: Clip, skeleton: Skeleton, other: Skeleton) -> Clip:
    """Return the clip with a key for each unanimated property that differs between two rest poses.

    skeleton, other: the rest poses. The clip then plays identically on both: keys replace the rest pose of `skeleton`.
    """
    animated = {(track.node, track.path) for track in clip.tracks}
    axis, tracks = TimeAxis([clip.start]), list(clip.tracks)
    for path in ("translation", "rotation", "scale"):
        here, there = getattr(skeleton, path), getattr(other, path)
        for node in np.flatnonzero((here != there).any(axis=1)).tolist():
            if (node, path) not in animated:
                tracks.append(Track(node, path, Interpolation.LINEAR, axis, here[node][None]))
    return Clip(clip.name, tuple(tracks))


def _bind_matrices(
    skeleton: Skeleton, world: Floats, held: tuple[int, Skin], known: dict[int, Floats]
) -> dict[int, Floats]:
    """World bind matrices (3, 4) by joint of a skin."""
    joints, inverse = held[1].joints, held[1].inverse_bind
    in_mesh = matrix.inverse(inverse)
    moves = matrix.multiply(world[joints], inverse)
    volumes = np.abs(np.linalg.det(moves[:, :, :3]))
    usual = float(np.median(volumes))
    sound = _last_of_each(joints, np.flatnonzero(np.abs(volumes - usual) <= 3 * SCALE_TOLERANCE * usual))
    if not usual > 0 or not len(sound):
        return {}
    shared = [j for j in sound.tolist() if int(joints[j]) in known]
    if shared:
        placed = matrix.multiply(known[int(joints[shared[0]])], inverse[shared[0]])
    else:
        placed = _world_from_mesh(skeleton, world, held[0], joints[sound], in_mesh[sound], usual)
    return {int(joints[j]): matrix.multiply(placed, in_mesh[j]) for j in sound.tolist()}


def _last_of_each(joints: Ints, chosen: Ints) -> Ints:
    """The chosen indices without those of a joint that a later one has too, which glTF forbids."""
    last = dict(zip(joints[chosen].tolist(), chosen.tolist(), strict=True))
    return np.array(list(last.values()), np.int64)


def _world_from_mesh(
    skeleton: Skeleton, world: Floats, holder: int, joints: Ints, in_mesh: Floats, volume: float
) -> Floats:
    """world_from_mesh (3, 4) when the skin was bound, with the scale that gives `volume`.

    The scale is that of the joints: vertices may be in centimeters and nodes in meters.
    """
    nodes = {holder, *(int(node) for node in skeleton.parents[joints] if node >= 0)} - set(joints.tolist())
    choices = np.stack([np.eye(4)[:3], *(world[node] for node in sorted(nodes))])
    volumes = np.abs(np.linalg.det(choices[:, :, :3]))
    choices, volumes = choices[volumes > 0], volumes[volumes > 0]
    choices[:, :, :3] *= np.cbrt(volume / volumes)[:, None, None]
    far = [np.linalg.norm(matrix.multiply(m, in_mesh)[:, :, 3] - world[joints, :, 3], axis=1).sum() for m in choices]
    return np.asarray(choices[int(np.argmin(far))])


def _count_moved(world: Floats, bound: dict[int, Floats]) -> int:
    """Count of joints that rest elsewhere than they were bound."""
    if not bound:
        return 0
    there, here = np.stack([*bound.values()]), world[[*bound]]
    size = float(np.ptp(here[:, :, 3], axis=0).max())
    far = np.linalg.norm(there[:, :, 3] - here[:, :, 3], axis=1) > MIN_OFFSET_FRACTION * size
    one, two = (matrix.decompose(each)[1] for each in (there, here))
    return int((far | (quaternion.angle_between(one, two) > MIN_ANGLE_RAD)).sum())


def _set_rest(skeleton: Skeleton, world: Floats, bound: dict[int, Floats]) -> Skeleton:
    """The skeleton with joints in the bind pose."""
    parts = {path: getattr(skeleton, path).copy() for path in ("translation", "rotation", "scale")}
    found, parents = world.copy(), skeleton.parents.tolist()
    for node in itertools.chain.from_iterable(level.tolist() for level in skeleton.levels()):
        parent = parents[node]
        goal, above = (bound[node], found) if node in bound else (world[node], world)
        local = goal if parent < 0 else matrix.multiply(matrix.inverse(above[parent]), goal)
        if node in bound:
            for path, value in zip(parts, matrix.decompose(local)[:3], strict=True):
                parts[path][node] = value
        found[node] = local if parent < 0 else matrix.multiply(found[parent], local)
    return replace(skeleton, **parts)
