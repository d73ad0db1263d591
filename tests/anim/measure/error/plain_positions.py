"""Positions of vertices and matrices of nodes by plain loops and scipy."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from anim.arrays import Floats
from anim.model import Clip, Scene, Skeleton, Track


def plain_vertices(scene: Scene, played: Clip, time: float) -> list[Floats]:
    world = [_matrix(*each) for each in plain_world(scene.skeleton, played, time)]
    result = []
    for instance in scene.instances:
        assert instance.skin is not None
        binds = zip(instance.skin.joints.tolist(), instance.skin.inverse_bind, strict=True)
        bound = [world[joint] @ np.vstack((bind, [0, 0, 0, 1])) for joint, bind in binds]
        for v, point in enumerate(instance.mesh.positions):
            influences = zip(instance.mesh.joints[v], instance.mesh.weights[v], strict=True)
            result.append(sum(w * (bound[j] @ [*point, 1])[:3] for j, w in influences))
    return result


def plain_world(nodes: Skeleton, played: Clip, time: float) -> list[tuple[Floats, Rotation]]:
    """Place and turn of every node against the world; the fixtures' nodes have no scale."""
    by_target = {each.target: each for each in played.tracks}
    result: list[tuple[Floats, Rotation]] = []
    for node, parent in enumerate(nodes.parents.tolist()):
        assert parent < node
        place, turn = nodes.translation[node].copy(), Rotation.from_quat(nodes.rotation[node])
        if (node, "translation") in by_target:
            place = _lerp(by_target[node, "translation"], time)
        if (node, "rotation") in by_target:
            turn = _slerp(by_target[node, "rotation"], time)
        if parent >= 0:
            above, around = result[parent]
            place, turn = above + around.apply(place), around * turn
        result.append((place, turn))
    return result


def _matrix(place: Floats, turn: Rotation) -> Floats:
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = turn.as_matrix(), place
    return whole


def _lerp(each: Track, time: float) -> Floats:
    return np.array([np.interp(time, each.times, each.values[:, i]) for i in range(3)])


def _slerp(each: Track, time: float) -> Rotation:
    turns = Rotation.from_quat(each.values)
    if len(each.times) == 1:
        return turns[0]
    return Slerp(each.times, turns)(np.clip(time, each.times[0], each.times[-1]))
