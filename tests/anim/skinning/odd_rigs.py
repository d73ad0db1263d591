"""Rigs as other tools leave them: other units, a joint that nothing hangs on, weights that don't add up."""

from __future__ import annotations

import json
import struct
from dataclasses import replace

import numpy as np

from anim.model import MeshInstance, Scene, Skeleton, Skin

FLOAT = 5126
UNIT = 100.0  # of the mesh, in metres


def with_root_without_weight(of: Scene) -> Scene:
    """Return a scene of one skin whose mesh is in hundredths of a metre, and a joint without weight before all others.

    Bind matrices take the mesh back to metres; that of the new joint, a node that stays at the origin, is the identity.
    """
    (instance,) = of.instances
    skin, body, count = instance.skin, instance.mesh, len(of.skeleton)
    assert skin is not None
    binds = np.concatenate((np.eye(4)[None, :3], skin.inverse_bind / [UNIT, UNIT, UNIT, 1]))
    larger = replace(body, positions=body.positions * UNIT, joints=body.joints + 1)
    moved = MeshInstance(instance.node, larger, Skin(np.append(count, skin.joints), binds), instance.weights)
    return Scene(with_root(of.skeleton, "root without weight"), (moved,))


def with_root(skeleton: Skeleton, name: str) -> Skeleton:
    """Return a skeleton with one more node, the last, at the origin."""
    return replace(
        skeleton,
        names=(*skeleton.names, name),
        parents=np.append(skeleton.parents, -1),
        translation=np.append(skeleton.translation, [[0.0, 0, 0]], axis=0),
        rotation=np.append(skeleton.rotation, [[0.0, 0, 0, 1]], axis=0),
        scale=np.append(skeleton.scale, [[1.0, 1, 1]], axis=0),
    )


def with_bad_sums(glb: bytes) -> bytes:
    """Return a GLB where every third vertex has other sums of weights than 1, 0.5 to 1.5, and every fiftieth 0."""
    (length,) = struct.unpack_from("<I", glb, 12)
    content = json.loads(glb[20 : 20 + length])
    spoiled = bytearray(glb)
    random = np.random.default_rng(0)
    for primitive in (each for mesh in content["meshes"] for each in mesh["primitives"]):
        about = content["accessors"][primitive["attributes"]["WEIGHTS_0"]]
        assert about["componentType"] == FLOAT
        view = content["bufferViews"][about["bufferView"]]
        start = 28 + length + view.get("byteOffset", 0) + about.get("byteOffset", 0)
        stride = view.get("byteStride", 16)
        weights = np.ndarray((about["count"], 4), "<f4", spoiled, start, (stride, 4))
        weights[::3] *= random.uniform(0.5, 1.5, (len(weights[::3]), 1))
        weights[5::50] = 0
    return bytes(spoiled)
