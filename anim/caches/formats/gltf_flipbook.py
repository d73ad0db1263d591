"""VertexCache → .glb as a flip-book: a mesh for every frame, one visible at a time, no interpolation.

No limit of morph targets, lossless, but every frame costs 12 bytes a vertex. Pages are switched by KHR_node_visibility
with an animation pointer, or by a scale of 0 or 1, supported by every glTF viewer.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from anim.arrays import AnyArray, Floats
from anim.caches.formats.gltf_stream import GlbFile, primitive, signed
from anim.caches.options import WriteOptions, WriteResult
from anim.caches.storage import Outputs
from anim.gltf.authoring_parts import VERTICES
from anim.model import FrameChunk, VertexCache

NAME = "flipbook"
EXTRAS = "gltf_anim"
POINTER, VISIBILITY = "KHR_animation_pointer", "KHR_node_visibility"


def write_visibility(cache: VertexCache, outputs: Outputs, writing: WriteOptions) -> WriteResult:
    """Write a flip-book with pages switched by KHR_node_visibility."""
    _write(cache, outputs, by_scale=False)
    return WriteResult(notes=(f"needs a viewer that knows {VISIBILITY}; the layout flip-scale plays everywhere",))


def write_scale(cache: VertexCache, outputs: Outputs, writing: WriteOptions) -> WriteResult:
    """Write a flip-book with pages switched by their scale."""
    _write(cache, outputs, by_scale=True)
    return WriteResult()


def _write(cache: VertexCache, outputs: Outputs, *, by_scale: bool) -> None:
    from pygltflib import Animation, AnimationChannel, AnimationSampler, Mesh, Node

    file = GlbFile()
    gltf = file.gltf
    indices = file.add_indices(cache.faces, cache.vertex_count)
    times = cache.times.astype("<f4")
    middle = file.add(_switched(by_scale, (0, 1, 0))) if cache.frame_count > 1 else 0
    first, last = file.add(_switched(by_scale, (1, 0))), file.add(_switched(by_scale, (0, 1)))
    gltf.nodes.append(Node(name=NAME, children=[], extras={EXTRAS: {"cache": "flipbook", "up": cache.up}}))
    gltf.scenes[0].nodes.append(0)
    clip = Animation(name=NAME, channels=[], samplers=[])
    for chunk in cache.chunks():
        for i in range(len(chunk.positions)):
            frame = chunk.first + i
            attributes = _attributes(file, chunk, i, cache.handedness)
            gltf.meshes.append(Mesh(primitives=[primitive(attributes, indices)]))
            gltf.nodes[0].children.append(len(gltf.nodes))
            gltf.nodes.append(_page(frame, by_scale=by_scale))
            if cache.frame_count == 1:
                continue
            keys = _keys(times, frame)
            output = middle if len(keys) == 3 else last if frame else first
            sampler = AnimationSampler(input=file.add(keys[:, None], bounds=True), output=output, interpolation="STEP")
            target = _target(frame + 1, by_scale=by_scale)
            clip.channels.append(AnimationChannel(sampler=len(clip.samplers), target=target))
            clip.samplers.append(sampler)
    if clip.channels:
        gltf.animations.append(clip)
    if not by_scale:
        gltf.extensionsUsed = [POINTER, VISIBILITY] if clip.channels else [VISIBILITY]
    file.write(outputs, outputs.main)


def _attributes(file: GlbFile, chunk: FrameChunk, i: int, handedness: Floats | None) -> dict[str, int]:
    """Accessors of frame i of a chunk."""
    found = {"POSITION": file.add(chunk.positions[i].astype("<f4"), target=VERTICES, bounds=True)}
    if chunk.normals is not None:
        found["NORMAL"] = file.add(chunk.normals[i].astype("<f4"), target=VERTICES)
    if chunk.tangents is not None and handedness is not None:
        found["TANGENT"] = file.add(signed(chunk.tangents[i], handedness), target=VERTICES)
    return found


def _page(frame: int, *, by_scale: bool) -> Any:
    """A node with the mesh of a frame, visible only for the first frame."""
    from pygltflib import Node

    node = Node(mesh=frame)
    if not by_scale:
        node.extensions = {VISIBILITY: {"visible": frame == 0}}
    elif frame:
        node.scale = [0.0, 0.0, 0.0]
    return node


def _target(node: int, *, by_scale: bool) -> Any:
    from pygltflib import AnimationChannelTarget

    if by_scale:
        return AnimationChannelTarget(node=node, path="scale")
    pointer = f"/nodes/{node}/extensions/{VISIBILITY}/visible"
    return AnimationChannelTarget(path="pointer", extensions={POINTER: {"pointer": pointer}})


def _keys(times: AnyArray, frame: int) -> AnyArray:
    """Key times of a page: hidden before its time and from the next page's on; the last one remains."""
    if frame == 0:
        return times[:2]
    return np.concatenate((times[:1], times[frame : frame + 2]))


def _switched(by_scale: bool, values: tuple[int, ...]) -> AnyArray:
    column = np.array(values, "<f4" if by_scale else "u1")[:, None]
    return np.repeat(column, 3, axis=1) if by_scale else column
