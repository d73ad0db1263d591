"""Equal skinned meshes: they deform alike, so that one analysis is enough for all of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from anim.model import MeshInstance
from anim.sampling.pose import PosedSkeleton


def first_equal_mesh(instances: Sequence[MeshInstance], rest: PosedSkeleton) -> list[int]:
    """Return for each skinned instance the index of the first one with equal vertices, faces and skin.

    Names, and the place of the node, which a skin ignores, don't count; whether it mirrors its mesh does. rest: the
    skeleton in its rest pose. Meshes with morph targets, which move by their node, are equal to none.
    first_equal_mesh([coat, hat, coat_copy], rest) → [0, 1, 0]
    """
    mirrored = np.linalg.det(rest.world[[each.node for each in instances], 0, :, :3]) < 0
    sizes = [_size(each) for each in instances]
    counts = Counter(sizes)
    first: dict[object, int] = {}
    return [
        first.setdefault((_digest(each), is_mirrored) if size and counts[size] > 1 else i, i)
        for i, (each, size, is_mirrored) in enumerate(zip(instances, sizes, mirrored.tolist(), strict=True))
    ]


def _size(instance: MeshInstance) -> tuple[int, ...]:
    """Numbers of values: without this most meshes would be hashed for nothing. () for one that is equal to none."""
    mesh, skin = instance.mesh, instance.skin
    if skin is None or len(mesh.targets):
        return ()
    return len(mesh.positions), mesh.faces.size, mesh.joints.size, len(skin.joints)


def _digest(instance: MeshInstance) -> bytes:
    import hashlib  # loads OpenSSL, and few files have meshes to hash

    assert instance.skin is not None
    digest = hashlib.blake2b(digest_size=16)
    mesh, skin = instance.mesh, instance.skin
    for each in (mesh.positions, mesh.faces, mesh.joints, mesh.weights, skin.joints, skin.inverse_bind):
        digest.update(repr((each.dtype.str, each.shape)).encode())
        digest.update(each.tobytes())
    return digest.digest()
