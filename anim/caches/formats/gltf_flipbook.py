"""VertexCache → .glb as a flip-book: a mesh for every frame, one visible at a time, no interpolation.

No limit of morph targets, lossless, but every frame costs 12 bytes a vertex. Pages are switched by KHR_node_visibility
with an animation pointer, or by a scale of 0 or 1, supported by every glTF viewer.
"""

from __future__ import annotations

from anim.arrays import Floats
from anim.caches.formats import flipbook_keys
from anim.caches.formats.gltf_stream import GlbFile, primitive, signed, write_document
from anim.caches.options import WriteOptions, WriteResult
from anim.caches.source_document.changed_references import reference_notes
from anim.caches.source_document.flipbook_pages import replace_by_pages
from anim.caches.storage import Outputs
from anim.gltf.authoring_parts import VERTICES
from anim.gltf.document import Json
from anim.model import FrameChunk, VertexCache

NAME = "flipbook"
EXTRAS = "gltf_anim"


def write_visibility(cache: VertexCache, outputs: Outputs, writing: WriteOptions) -> WriteResult:
    """Write a flip-book with pages switched by KHR_node_visibility."""
    lost = _write(cache, outputs, writing, by_scale=False)
    known = f"needs a viewer that knows {flipbook_keys.VISIBILITY}; the layout flip-scale plays everywhere"
    return WriteResult(notes=(known, *lost))


def write_scale(cache: VertexCache, outputs: Outputs, writing: WriteOptions) -> WriteResult:
    """Write a flip-book with pages switched by their scale."""
    return WriteResult(notes=_write(cache, outputs, writing, by_scale=True))


def _write(cache: VertexCache, outputs: Outputs, writing: WriteOptions, *, by_scale: bool) -> tuple[str, ...]:
    """Write the pages; return notes on what the source loses."""
    extras = {EXTRAS: {"cache": NAME, "up": cache.up}}
    if writing.source is None:
        _write_alone(cache, outputs, extras, by_scale=by_scale)
        return ()
    document = replace_by_pages(cache, writing.source, extras=extras, by_scale=by_scale)
    write_document(document, outputs)
    return reference_notes(writing.source, document.json)


def _write_alone(cache: VertexCache, outputs: Outputs, extras: Json, *, by_scale: bool) -> None:
    from pygltflib import Animation, AnimationChannel, AnimationChannelTarget, AnimationSampler, Mesh, Node

    file = GlbFile()
    gltf = file.gltf
    indices = file.add_indices(cache.faces, cache.vertex_count)
    times = cache.times.astype("<f4")
    last = cache.frame_count - 1
    shown = {
        frame: file.add(flipbook_keys.visible(frame, cache.frame_count, by_scale=by_scale))
        for frame in sorted({0, min(1, last), last})
    }
    gltf.nodes.append(Node(name=NAME, children=[], extras=extras))
    gltf.scenes[0].nodes.append(0)
    clip = Animation(name=NAME, channels=[], samplers=[])
    for chunk in cache.chunks():
        for i in range(len(chunk.positions)):
            frame = chunk.first + i
            attributes = _attributes(file, chunk, i, cache.handedness)
            gltf.meshes.append(Mesh(primitives=[primitive(attributes, indices)]))
            gltf.nodes[0].children.append(len(gltf.nodes))
            gltf.nodes.append(Node(**flipbook_keys.page(frame, frame, by_scale=by_scale)))
            if cache.frame_count == 1:
                continue
            keys = file.add(flipbook_keys.keys(times, frame)[:, None], bounds=True)
            sampler = AnimationSampler(input=keys, output=shown.get(frame, shown[1]), interpolation="STEP")
            target = AnimationChannelTarget(**flipbook_keys.target(frame + 1, by_scale=by_scale))
            clip.channels.append(AnimationChannel(sampler=len(clip.samplers), target=target))
            clip.samplers.append(sampler)
    if clip.channels:
        gltf.animations.append(clip)
    gltf.extensionsUsed = list(flipbook_keys.extensions(cache.frame_count, by_scale=by_scale))
    file.write(outputs, outputs.main)


def _attributes(file: GlbFile, chunk: FrameChunk, i: int, handedness: Floats | None) -> dict[str, int]:
    """Accessors of frame i of a chunk."""
    found = {"POSITION": file.add(chunk.positions[i].astype("<f4"), target=VERTICES, bounds=True)}
    if chunk.normals is not None:
        found["NORMAL"] = file.add(chunk.normals[i].astype("<f4"), target=VERTICES)
    if chunk.tangents is not None and handedness is not None:
        found["TANGENT"] = file.add(signed(chunk.tangents[i], handedness), target=VERTICES)
    return found
