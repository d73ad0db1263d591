"""The collapse index: how flat linear blending makes the space around a vertex."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anim.arrays import Bools, Floats
from anim.maths import quaternion
from anim.model import Clip, Scene, Skeleton
from anim.skinning.compiled import compiled
from anim.skinning.frames import Playback
from anim.skinning.kernels.lanes import LANES, Singles, room
from anim.skinning.kernels.shrinkage import shrinkage
from anim.skinning.layer import Layer
from anim.skinning.rig import whole_weights
from anim.skinning.skinner import filled, lanes
from anim.skinning.stretch import pivots, split, topmost

TWIST = 0.7  # cosine between the axis of a turn and the link, above which the turn is a twist


@dataclass(frozen=True, slots=True)
class Narrow:
    """The vertex and time where linear blending is narrowest.

    index: √ of the volume factor: 1 rigid, 0 flat or inside out; the radius of a twisted ring against that at rest.
    vertex: of the mesh. joint, other: names of its two strongest joints. time: s. angle: rad between the two then.
    twist: whether they turn about the link between them, rather than bend.
    """

    index: float
    vertex: int
    joint: str
    other: str
    time: float
    angle: float
    twist: bool


@dataclass(frozen=True, slots=True)
class Indices:
    """Collapse indices of one mesh in one clip.

    least: (V,) of each vertex at its worst time. by_frame: (F,) of the worst vertex. inverted: (V,) whether it is ever
    turned inside out.
    """

    least: Floats
    by_frame: Floats
    inverted: Bools
    worst: Narrow


def indices(scene: Scene, layer: Layer, clip: Clip, times: Floats) -> Indices:
    """Return the collapse indices of a skinned mesh at `times` (F,) s while a clip plays.

    √D with D = det(Σ w A) / Π |det A|^w, A the linear parts of the joints' matrices and w shares of the weights' sum:
    scales are divided out. Joints of scale 0 don't count as collapse.
    """
    rig = layer.rig
    playback = Playback(scene.skeleton, clip)
    held, space = rig.held._replace(weight=whole_weights(rig)), room(rig.most)
    least = np.full(len(rig.points), np.inf, np.float32)
    when = np.zeros(len(rig.points), np.int64)
    by_frame = np.zeros(len(times))
    for first in range(0, len(times), LANES):
        matrices = layer.matrices(playback.at(times[first : first + LANES]), slice(None))
        factors: Singles = np.empty((len(rig.points), len(matrices)), np.float32)
        compiled(shrinkage)(held, lanes(matrices), _logs(matrices), space, factors)
        factors[~np.isfinite(factors) | (np.diff(rig.start) == 0)[:, None]] = 1
        by_frame[first : first + LANES] = factors.min(axis=0, initial=1)
        at = factors.argmin(axis=1)
        lowest = np.take_along_axis(factors, at[:, None], 1)[:, 0]
        when[lowest < least] = first + at[lowest < least]
        least = np.minimum(least, lowest)
    root = np.sqrt(np.clip(least.astype(np.float64), 0, None))
    worst = int(least.argmin())
    time = float(times[when[worst]])
    narrow = _narrow(scene.skeleton, layer, playback, worst, time, float(root[worst]))
    return Indices(root, np.sqrt(np.clip(by_frame, 0, None)), least < 0, narrow)


def _logs(matrices: Floats) -> Singles:
    """log |det A| (J, LANES); NaN for a flat joint."""
    sizes = np.abs(np.linalg.det(matrices[..., :3]))
    return filled(np.log(np.where(sizes > 0, sizes, np.nan)).T)


def _narrow(names: Skeleton, layer: Layer, playback: Playback, vertex: int, time: float, index: float) -> Narrow:
    rig = layer.rig
    held = rig.joint[rig.start[vertex] : rig.start[vertex + 1]].tolist()
    if not held:
        return Narrow(index, vertex, "", "", time, 0.0, False)
    a, b = held[0], held[1] if len(held) > 1 else held[0]
    matrices = layer.matrices(playback.at(np.array([time])), slice(None))
    rotation = split(matrices, pivots(rig), topmost(rig.above)).rotation[0]
    turn = quaternion.rotation_vector(quaternion.multiply(quaternion.conjugate(rotation[a]), rotation[b]))
    angle, link = float(np.linalg.norm(turn)), np.diff(pivots(rig)[[a, b]], axis=0)[0]
    along = abs(float(turn @ link))
    is_twist = along > TWIST * angle * float(np.linalg.norm(link)) and along > 0
    return Narrow(index, vertex, _name(names, rig.nodes[a]), _name(names, rig.nodes[b]), time, angle, is_twist)


def _name(skeleton: Skeleton, node: int) -> str:
    return skeleton.names[node] or f"node {node}"
