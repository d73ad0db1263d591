"""VertexCache → .glb as a flip-book: a mesh for every frame, of which one is shown at a time, with nothing in between.

No limit of morph targets, no loss, but every frame costs 12 bytes a vertex. Shown by KHR_node_visibility, which an
animation pointer switches, or by a scale of 0 or 1, which every viewer of glTF knows.
"""

from __future__ import annotations

import numpy as np

from anim.arrays import AnyArray
from anim.caches.files import Outputs
from anim.caches.glb_file import VERTICES, GlbFile, primitive, signed
from anim.caches.settings import Writing, Written
from anim.model import VertexCache

NAME = "flipbook"
EXTRAS = "gltf_anim"
POINTER, VISIBILITY = "KHR_animation_pointer", "KHR_node_visibility"


def write_visibility(cache: VertexCache, outputs: Outputs, writing: Writing) -> Written:
    """Write a flip-book whose pages are switched by KHR_node_visibility."""
    _write(cache, outputs, by_scale=False)
    return Written(notes=(f"needs a viewer that knows {VISIBILITY}; the layout flip-scale plays everywhere",))


def write_scale(cache: VertexCache, outputs: Outputs, writing: Writing) -> Written:
    """Write a flip-book whose pages are switched by their scale."""
    _write(cache, outputs, by_scale=True)
    return Written()


def _write(cache: VertexCache, outputs: Outputs, *, by_scale: bool) -> None:
    from pygltflib import Animation, AnimationChannel, AnimationChannelTarget, AnimationSampler, Mesh, Node

    file = GlbFile()
    gltf = file.gltf
    indices = file.add_indices(cache.faces, cache.vertex_count)
    times = cache.times.astype("<f4")
    shown = file.add(_switched(by_scale, (0, 1, 0))) if cache.frame_count > 1 else 0
    first_shown, last_shown = file.add(_switched(by_scale, (1, 0))), file.add(_switched(by_scale, (0, 1)))
    gltf.nodes.append(Node(name=NAME, children=[], extras={EXTRAS: {"cache": "flipbook", "up": cache.up}}))
    gltf.scenes[0].nodes.append(0)
    clip = Animation(name=NAME, channels=[], samplers=[])
    for chunk in cache.chunks():
        for i, positions in enumerate(chunk.positions):
            frame = chunk.first + i
            attributes = {"POSITION": file.add(positions.astype("<f4"), target=VERTICES, bounds=True)}
            if chunk.normals is not None:
                attributes["NORMAL"] = file.add(chunk.normals[i].astype("<f4"), target=VERTICES)
            if chunk.tangents is not None and cache.handedness is not None:
                attributes["TANGENT"] = file.add(signed(chunk.tangents[i], cache.handedness), target=VERTICES)
            gltf.meshes.append(Mesh(primitives=[primitive(attributes, indices)]))
            node = Node(mesh=frame)
            if frame and by_scale:
                node.scale = [0.0, 0.0, 0.0]
            elif not by_scale:
                node.extensions = {VISIBILITY: {"visible": frame == 0}}
            gltf.nodes[0].children.append(len(gltf.nodes))
            gltf.nodes.append(node)
            keys, values = _keys(times, frame), (shown, first_shown, last_shown)
            output = values[0] if len(keys) == 3 else values[1] if frame == 0 else values[2]
            if cache.frame_count == 1:
                continue
            sampler = AnimationSampler(input=file.add(keys[:, None], bounds=True), output=output, interpolation="STEP")
            target = AnimationChannelTarget(node=frame + 1, path="scale")
            if not by_scale:
                pointer = f"/nodes/{frame + 1}/extensions/{VISIBILITY}/visible"
                target = AnimationChannelTarget(path="pointer", extensions={POINTER: {"pointer": pointer}})
            clip.channels.append(AnimationChannel(sampler=len(clip.samplers), target=target))
            clip.samplers.append(sampler)
    if clip.channels:
        gltf.animations.append(clip)
    if not by_scale:
        gltf.extensionsUsed = [POINTER, VISIBILITY] if clip.channels else [VISIBILITY]
    file.write(outputs, outputs.main)


def _keys(times: AnyArray, frame: int) -> AnyArray:
    """When a page changes: it is hidden before its time and from the next page's on; the last one stays."""
    if frame == 0:
        return times[:2]
    before = times[0] if frame > 0 else 0
    if frame == len(times) - 1:
        return np.array([before, times[frame]], "<f4")
    return np.array([before, times[frame], times[frame + 1]], "<f4")


def _switched(by_scale: bool, values: tuple[int, ...]) -> AnyArray:
    column = np.array(values, "<f4" if by_scale else "u1")[:, None]
    return np.repeat(column, 3, axis=1) if by_scale else column
