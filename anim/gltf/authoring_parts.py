"""pygltflib objects shared by all authored documents."""

from __future__ import annotations

from typing import TYPE_CHECKING

import anim
from anim.arrays import AnyArray

if TYPE_CHECKING:
    from pygltflib import GLTF2, Material

COMPONENT_TYPES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
ELEMENT_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
VERTICES, INDICES = 34962, 34963  # buffer view targets
BODY_COLOR = (0.8, 0.55, 0.25, 1.0)  # linear RGBA


def create_document() -> GLTF2:
    """Return a document with one empty scene."""
    from pygltflib import GLTF2, Asset, Scene

    asset = Asset(generator=f"gltf-anim {anim.__version__}", version="2.0")
    return GLTF2(asset=asset, scene=0, scenes=[Scene(nodes=[])])


def create_material(name: str | None = None, *, double_sided: bool = False) -> Material:
    """Return the default material of a mesh without one."""
    from pygltflib import Material, PbrMetallicRoughness

    surface = PbrMetallicRoughness(baseColorFactor=list(BODY_COLOR), metallicFactor=0.0, roughnessFactor=0.7)
    return Material(name=name, pbrMetallicRoughness=surface, doubleSided=double_sided)


def add_accessor(
    gltf: GLTF2,
    rows: AnyArray,
    *,
    offset: int,
    length: int,
    stride: int | None = None,
    target: int | None = None,
    normalized: bool | None = False,
    bounds: bool = False,
) -> int:
    """Add an accessor of rows (n, C) with a buffer view of its own into buffer 0; return its index.

    offset, length: of the view, in bytes. stride: bytes per row, None where rows are tightly packed.
    normalized: None leaves the property out of the JSON.
    """
    from pygltflib import Accessor, BufferView

    view = BufferView(buffer=0, byteOffset=offset, byteLength=length, byteStride=stride, target=target)
    gltf.bufferViews.append(view)
    accessor = Accessor(
        bufferView=len(gltf.bufferViews) - 1,
        byteOffset=None,
        componentType=COMPONENT_TYPES[rows.dtype.str[1:]],
        normalized=normalized,
        count=len(rows),
        type=ELEMENT_TYPES[rows.shape[1]],
    )
    if bounds:
        accessor.min = [float(value) for value in rows.min(axis=0).tolist()]
        accessor.max = [float(value) for value in rows.max(axis=0).tolist()]
    gltf.accessors.append(accessor)
    return len(gltf.accessors) - 1
