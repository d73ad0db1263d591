"""Small meshes of a bake as one: work per mesh, in files of thousands, is then work per some thousand vertices."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import accumulate, groupby

import numpy as np

from anim.arrays import Floats, Ints
from anim.errors import AnimError
from anim.model import Mesh, MeshInstance, Skeleton, Skin
from anim.skinning.binding import check_influences

MAX_VERTICES = 1 << 10  # of a mesh that is merged with others
MERGED_VERTICES = 1 << 14  # of meshes that become one, about
NO_NODE = -1  # of a mesh that is several


def merge_small_meshes(instances: Sequence[MeshInstance], skeleton: Skeleton, *, skinned: bool) -> list[MeshInstance]:
    """Return the same vertices and faces in the same order, neighbors without morph targets as one skinned instance.

    skinned: whether those with a skin are merged too: blended linearly, the joints of other vertices do not count.
    Raises RangeError for a joint that the skin does not have.
    """
    starts = accumulate((len(each.mesh.positions) for each in instances), initial=0)
    numbered = zip(instances, starts, range(len(instances)), strict=False)
    runs = groupby(numbered, lambda each: _key(*each, skinned=skinned))
    return [_merge([each for each, _, _ in run], skeleton) for _, run in runs]


def _key(instance: MeshInstance, start: int, number: int, *, skinned: bool) -> tuple[object, ...]:
    """A key that neighbors share which become one. start: the number of vertices before."""
    mesh, skin = instance.mesh, instance.skin
    if len(mesh.targets) or len(mesh.positions) > MAX_VERTICES or (skin is not None and not skinned):
        return (number,)
    width = 1 if skin is None else mesh.joints.shape[1]
    return start // MERGED_VERTICES, width, mesh.normals is None, mesh.tangents is None


def _merge(parts: list[MeshInstance], skeleton: Skeleton) -> MeshInstance:
    if len(parts) == 1:
        return parts[0]
    meshes, skins = [each.mesh for each in parts], [_skin(each) for each in parts]
    sizes = [len(mesh.positions) for mesh in meshes]
    starts = np.cumsum([0, *sizes[:-1]]).tolist()
    firsts = np.cumsum([0, *(len(skin.joints) for skin in skins[:-1])])
    influences = [_influences(each, skeleton) for each in parts]
    positions = np.concatenate([mesh.positions for mesh in meshes])
    merged = Mesh(
        "",
        positions,
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]),
        np.concatenate([joints for joints, _ in influences]) + np.repeat(firsts, sizes)[:, None],
        np.concatenate([weights for _, weights in influences]),
        np.empty((0, len(positions), 3)),
        np.empty(0),
        normals=_of_all(mesh.normals for mesh in meshes),
        tangents=_of_all(mesh.tangents for mesh in meshes),
    )
    skin = Skin(np.concatenate([skin.joints for skin in skins]), np.concatenate([skin.inverse_bind for skin in skins]))
    return MeshInstance(NO_NODE, merged, skin, np.empty(0))


def _skin(instance: MeshInstance) -> Skin:
    """Its skin; without one, its node as the only joint."""
    return instance.skin or Skin(np.array([instance.node], np.int64), np.eye(4)[None, :3])


def _influences(instance: MeshInstance, skeleton: Skeleton) -> tuple[Ints, Floats]:
    mesh, count = instance.mesh, len(instance.mesh.positions)
    if instance.skin is None:
        return np.zeros((count, 1), np.int64), np.ones((count, 1))
    try:
        check_influences(mesh.joints, mesh.weights, len(instance.skin.joints))
    except AnimError as error:
        raise error.at(f"mesh '{mesh.name or skeleton.display_name(instance.node)}'") from None
    return mesh.joints, mesh.weights


def _of_all(directions: Iterable[Floats | None]) -> Floats | None:
    """Normals or tangents of all meshes, None if they have none."""
    found = [each for each in directions if each is not None]
    return np.concatenate(found) if found else None
