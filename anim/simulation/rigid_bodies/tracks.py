"""Motion of bodies → translation and rotation tracks of their nodes, relative to static or animated parents."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Bools, Floats, Ints
from anim.curves.fitting.key_reduction import greedy_indices
from anim.maths import matrix, quaternion
from anim.model import Clip, Interpolation, Skeleton, TimeAxis, Track
from anim.sampling.pose import PoseSampler
from anim.sampling.times import distinct_float32
from anim.sampling.world import local_by_node
from anim.simulation.rigid_bodies.motion import RigidMotion
from anim.simulation.rigid_bodies.rigid_scene import RigidScene

SCALE_TOLERANCE = 1e-5  # relative change of a node's scale that needs no track
ONE: Floats = np.ones(3)


@dataclass(frozen=True, slots=True, eq=False)
class BodyTracks:
    """Tracks of the bodies' nodes. num_impacts: of all. shear: largest that TRS can't represent."""

    tracks: list[Track]
    num_impacts: int
    shear: float


class WorldAtTimes:
    """World matrices of nodes while bodies move and the clip plays."""

    def __init__(self, skeleton: Skeleton, clip: Clip, rest: Floats, rigid: RigidScene, motion: RigidMotion) -> None:
        """rest: world_from_node (N, 3, 4) at the start of the simulation, which has the bodies' scales."""
        self._skeleton = skeleton
        self._sampler = PoseSampler(skeleton, clip)
        self._tracked = {track.node for track in clip.tracks}
        self._motion = motion
        self._indices = {rigid.bodies[i].node: k for k, i in enumerate(rigid.moving)}
        frames = {rigid.bodies[i].node: rigid.bodies[i].frame for i in rigid.moving}
        self._scales = {
            node: matrix.multiply(matrix.inverse(matrix.from_trs(each.position, each.rotation, ONE)), rest[node])
            for node, each in frames.items()
        }

    def body(self, node: int, position: Floats, rotation: Floats) -> Floats:
        """Return world matrices (K, 3, 4) of a body's node from its frames (K, 3), (K, 4)."""
        return matrix.multiply(
            matrix.from_trs(position, rotation, np.broadcast_to(ONE, position.shape)), self._scales[node]
        )

    def world(self, node: int, times: Floats) -> Floats:
        """Return world matrices (K, 3, 4), or (3, 4) where the node doesn't move."""
        if node < 0:
            return np.eye(4)[:3]
        if node in self._indices:
            return self.body(node, *self._motion.at(self._indices[node], times))
        parent = self.world(int(self._skeleton.parents[node]), times)
        at = times if node in self._tracked else times[:1]
        local = local_by_node(self._skeleton, self._sampler.at(at))[node]
        return matrix.multiply(parent, local if node in self._tracked else local[0])


def make_tracks(
    skeleton: Skeleton,
    rigid: RigidScene,
    motion: RigidMotion,
    frames: Floats,
    worlds: WorldAtTimes,
    *,
    start: float = 0.0,
    max_error: float = 0.0,
) -> BodyTracks:
    """Return the tracks of all moving bodies: keys at frames and impacts, without those that change nothing.

    frames: (F,) s. start: s, added to the times of keys. max_error: m, of any point of a body's colliders, within which
    keys may go too; 0 for none.
    """
    tracks: list[Track] = []
    total, shear = 0, 0.0
    for k, i in enumerate(rigid.moving):
        body = rigid.bodies[i]
        impacts = motion.impacts[k]
        times, indices = _merge(frames, np.array([each.time for each in impacts]), start)
        positions, rotations = motion.at(k, times)
        for key in np.flatnonzero(indices >= 0).tolist():
            impact = impacts[indices[key]]
            same = slice(key, max(key + 1, int(np.searchsorted(times, impact.until))))
            positions[same], rotations[same] = impact.position, impact.rotation
        parent = worlds.world(int(skeleton.parents[body.node]), times)
        local = matrix.multiply(matrix.inverse(parent), worlds.body(body.node, positions, rotations))
        translation, rotation, scale, sheared = matrix.decompose(local)
        rotation = quaternion.align_signs(rotation)
        stretch = float(np.linalg.norm(parent[..., :3], axis=-2).max())
        kept = _needed(translation, rotation)
        if max_error > 0:
            kept = kept[_reduce(times[kept], stretch * translation[kept], rotation[kept], body.radius, max_error)]
        axis = TimeAxis(_stored(start + times[kept]))
        parts = {"translation": translation, "rotation": rotation}
        if np.ptp(scale, axis=0).max() > SCALE_TOLERANCE * np.abs(scale).max():
            parts["scale"] = scale
        tracks += [Track(body.node, path, Interpolation.LINEAR, axis, all_[kept]) for path, all_ in parts.items()]
        total, shear = total + len(impacts), max(shear, float(sheared.max()))
    return BodyTracks(tracks, total, shear)


def drop_replaced(clip: Clip, new: list[Track]) -> list[Track]:
    """Return the clip's tracks without those of a property that `new` has too."""
    replaced = {(track.node, track.path) for track in new}
    return [track for track in clip.tracks if (track.node, track.path) not in replaced]


def _merge(frames: Floats, impacts: Floats, start: float) -> tuple[Floats, Ints]:
    """Times of frames and impacts that float32 tells apart, and the index of the impact at each, −1 for frames."""
    inside = np.flatnonzero((impacts > frames[0]) & (impacts < frames[-1]))
    times = np.concatenate([frames, impacts[inside]])
    indices = np.concatenate([np.full(len(frames), -1), inside])
    order = np.argsort(times, kind="stable")
    times, indices = times[order], indices[order]
    kept = distinct_float32(start + times)
    return _stored(start + times[kept]) - start, indices[kept]


def _stored(times: Floats) -> Floats:
    """Times as float32 has them."""
    return np.asarray(times.astype(np.float32), np.float64)


def _needed(translation: Floats, rotation: Floats) -> Ints:
    """Indices of keys without those inside a run of equal ones: of a body that sleeps."""
    values = np.concatenate([translation, rotation], axis=1).astype(np.float32)
    same = (values[1:] == values[:-1]).all(axis=1)
    inside: Bools = np.zeros(len(values), np.bool_)
    inside[1:-1] = same[1:] & same[:-1]
    return np.flatnonzero(~inside)


def _reduce(times: Floats, translation: Floats, rotation: Floats, radius: float, max_error: float) -> Ints:
    """Indices of keys between which linear interpolation moves no point farther than `max_error` at the others."""

    def fits(start: int, end: int) -> bool:
        between = slice(start + 1, end)
        u = (times[between] - times[start]) / (times[end] - times[start])
        points = (1 - u[:, None]) * translation[start] + u[:, None] * translation[end]
        turned = quaternion.slerp(rotation[start], rotation[end], u)
        angle = quaternion.angle_between(turned, rotation[between])
        distance = np.linalg.norm(points - translation[between], axis=1) + 2 * radius * np.sin(angle / 2)
        return bool(distance.max() <= max_error)

    return greedy_indices(len(times), fits)
