"""How one method fares in a clip: what the mesh encloses, and how far it stands off its links."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from anim.arrays import AnyArray, Floats, Ints
from anim.model import Chunk, Clip, Skeleton
from anim.skinning.bake import Baker
from anim.skinning.bulge import Links, links, placed, stand_off
from anim.skinning.closed import closed_faces, volumes
from anim.skinning.compiled import compiled
from anim.skinning.frames import Frames, Playback
from anim.skinning.layer import Layer
from anim.skinning.stretch import topmost

BULGE = 1.05  # distance from the links, against that in bind pose, above which a vertex bulges
NEAR = 0.25  # of the middle distance: what lies nearer to a link has no ratio worth a word


@dataclass(frozen=True, slots=True)
class Fared:
    """How one method fared on one mesh.

    volume: (F,) enclosed against bind pose, None where no part of the mesh is closed.
    bulge: greatest distance of a vertex between two joints from their links, against that in bind pose.
    bulging: share of all vertices that are ever above 1.05. vertex, joint, time: where and when bulge is.
    """

    method: str
    volume: Floats | None
    bulge: float
    bulging: float
    vertex: int
    joint: str
    time: float


@dataclass(frozen=True, slots=True)
class Subject:
    """What of a mesh in bind pose later poses are held against.

    faces: (C, 3) of closed parts. volume: m³ that they enclose. watched: (W,) vertices whose bulge counts.
    """

    layer: Layer
    faces: Ints
    volume: float
    links: Links
    watched: Ints


def subject(layer: Layer) -> Subject:
    """Return the measures of a mesh in bind pose."""
    rig = layer.rig
    faces = rig.faces[closed_faces(rig.points, rig.faces)] if len(rig.faces) else rig.faces
    volume = float(volumes(rig.points[None], faces)[0]) if len(faces) else 0.0
    of = links(rig)
    shared = of.share > 0
    middle = float(np.median(of.distance[shared])) if shared.any() else 0.0
    watched = np.flatnonzero(shared & (of.distance > NEAR * middle))
    return Subject(layer, faces if volume else faces[:0], volume, of, watched)


def fared(baker: Baker, method: str, subjects: list[Subject], clip: Clip, times: Floats) -> Iterator[Fared]:
    """Yield how each of the baker's meshes fares at `times` (F,) s while a clip plays."""
    seen = [_Seen(each, len(times)) for each in subjects]
    playback = Playback(baker.scene.skeleton, clip)
    for chunk in baker.bake(clip, times=times).chunks():
        frames = playback.at(times[chunk.first : chunk.first + len(chunk.positions)])
        for each in seen:
            each.add(chunk, frames)
    for each in seen:
        yield each.summed(method, baker.scene.skeleton, times)


class _Seen:
    """What was seen of one mesh up to now."""

    def __init__(self, of: Subject, frames: int) -> None:
        self._of = of
        self._volume = np.zeros(frames)
        self._bulge = np.zeros(len(of.watched), np.float32)
        self._when = np.zeros(len(of.watched), np.int64)

    def add(self, chunk: Chunk, frames: Frames) -> None:
        """Look at some frames."""
        of, rig = self._of, self._of.layer.rig
        matrices = of.layer.matrices(frames, slice(None))
        span = slice(of.layer.at, of.layer.at + len(rig.points))
        if len(of.faces):
            common = np.abs(np.linalg.det(matrices[:, topmost(rig.above), :, :3]))
            enclosed = volumes(chunk.positions[:, span], of.faces)
            self._volume[chunk.first : chunk.first + len(enclosed)] = enclosed / (
                of.volume * np.where(common > 0, common, 1)
            )
        if len(of.watched):
            self._add_bulge(chunk.positions, matrices, chunk.first)

    def _add_bulge(self, positions: AnyArray, matrices: Floats, first: int) -> None:
        of, rig = self._of, self._of.layer.rig
        joints, scales = placed(of.links, matrices)
        squared = np.empty((len(positions), len(rig.points)), np.float32)
        held = (rig.start, rig.joint, of.links.start, of.links.tips)
        compiled(stand_off)(positions, of.layer.at, *held, joints, squared)
        pivot = rig.joint[rig.start[of.watched]]
        rest = of.links.distance[of.watched] * np.where(scales > 0, scales, np.inf)[:, pivot]
        ratio = np.sqrt(squared[:, of.watched]) / rest
        at = ratio.argmax(axis=0)
        most = np.take_along_axis(ratio, at[None], 0)[0]
        self._when[most > self._bulge] = first + at[most > self._bulge]
        self._bulge = np.maximum(self._bulge, most)

    def summed(self, method: str, skeleton: Skeleton, times: Floats) -> Fared:
        """Return what came of it."""
        of, rig = self._of, self._of.layer.rig
        volume = self._volume if len(of.faces) else None
        if not len(of.watched):
            return Fared(method, volume, 1.0, 0.0, 0, "", 0.0)
        most = int(self._bulge.argmax())
        vertex = int(of.watched[most])
        node = int(rig.nodes[rig.joint[rig.start[vertex]]])
        bulging = float((self._bulge > BULGE).sum()) / len(rig.points)
        where = (vertex, skeleton.names[node] or f"node {node}", float(times[self._when[most]]))
        return Fared(method, volume, float(self._bulge[most]), bulging, *where)
