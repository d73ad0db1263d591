"""VertexCache ↔ .glb and .gltf: morph targets or a flip-book; reading evaluates the whole document."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import PurePath
from typing import TypeAlias

import numpy as np

from anim.caches.formats import gltf_flipbook, gltf_morph
from anim.caches.formats.flipbook_reader import read_pages
from anim.caches.options import ReadOptions, WriteOptions, WriteResult
from anim.caches.storage import Inputs, Memory, Outputs, open_bytes
from anim.errors import NotFoundError, RangeError
from anim.gltf.document import Bytes, Document, json_array
from anim.gltf.io import container
from anim.gltf.io.gltf_files import BufferNames
from anim.gltf.reading import reader
from anim.model import Clip, VertexCache
from anim.sampling import frame_times
from anim.skinning.analysis.weight_sums import unnormalized_weights
from anim.skinning.bake import bake

Write: TypeAlias = Callable[[VertexCache, Outputs, WriteOptions], WriteResult]

LAYOUTS: dict[str, Write] = {
    "morph": gltf_morph.write,
    "flip-visibility": gltf_flipbook.write_visibility,
    "flip-scale": gltf_flipbook.write_scale,
}


def write(cache: VertexCache, outputs: Outputs, writing: WriteOptions) -> WriteResult:
    """Write a GLB in the layout `writing.layout`. Raises RangeError for an unknown one."""
    if writing.layout not in LAYOUTS:
        raise RangeError(f"`layout` is '{writing.layout}' (expected {', '.join(LAYOUTS)})")
    return LAYOUTS[writing.layout](cache, outputs, writing)


def check_frames(frames: int, vertices: int, writing: WriteOptions) -> None:
    """Raise UnsupportedError for more frames than the layout can write; flip-books are streamed."""
    if writing.layout == "morph":
        gltf_morph.check_frames(frames, vertices)


def write_with_buffers(cache: VertexCache, outputs: Outputs, writing: WriteOptions) -> WriteResult:
    """Write a .gltf in the layout `writing.layout`, and its buffers beside it, named as by `gltf_files`.

    Images stay as the source has them: those in files are not copied.
    """
    memory = Memory("cache.glb")
    result = write(cache, memory, writing)
    document = container.read(np.frombuffer(memory.files[memory.main], np.uint8))
    if writing.source is None:  # its first bytes name the format
        document = replace(document, json={"asset": document.json["asset"], **document.json})
    stem = PurePath(outputs.main).stem
    if outputs.folder is None:
        files = container.gltf(document, stem)
    else:
        files = container.gltf(document, stem, choose=BufferNames.of_file(outputs.folder, outputs.main).choose)
    for name, pieces in files.items():
        with outputs.create(outputs.main if name == f"{stem}.gltf" else name) as file:
            for piece in pieces:
                file.write(piece.data)
    return result


def read(inputs: Inputs, reading: ReadOptions) -> VertexCache:
    """Return the frames of a flip-book of this library, or the first clip of another glTF as frames.

    Morph targets and skins (linear blend) are evaluated at the clip's own keys, or at `reading.input_fps`.
    """
    with open_bytes(inputs, inputs.main) as data:
        document = container.read(np.frombuffer(data, np.uint8), lambda name: _beside(inputs, name))
    found = read_pages(document)
    if found is not None:
        return found
    played = evaluate_document(document, fps=reading.input_fps, note=reading.note)
    if names := directions(document):
        reading.note(f"{' and '.join(names)} are not played: bake the glTF file with them")
    return played


def _beside(inputs: Inputs, name: str) -> Bytes:
    with open_bytes(inputs, name) as data:
        return np.frombuffer(data, np.uint8)


def evaluate_document(
    document: Document, *, clip: int = 0, fps: float | None = None, note: Callable[[str], None] = lambda _: None
) -> VertexCache:
    """Return every vertex of the file during a clip, in world space, nodes depth-first.

    Primitives are in order. Frames are at `fps` per second, else at the clip's own keys; without clips there is one,
    the rest pose. The cache's `chosen` is the clip's label. The up axis is that stored by this library. note: called
    with a line about skin weights that do not sum to 1.
    Raises NotFoundError for a file without vertices.
    """
    scene, clips = reader.scene(document), reader.clips(document)
    for bad in unnormalized_weights(scene.instances):
        for words in bad.in_words():
            note(words)
    chosen = clips[clip] if clips else Clip("", ())
    if not scene.vertex_count:
        raise NotFoundError("has no mesh with vertices")
    times = frame_times(chosen.start, chosen.end, fps=fps) if fps is not None else chosen.key_times
    said = f"{reader.clip_label(chosen.name, clip)}, one of {len(clips)}" if len(clips) > 1 else ""
    return replace(bake(scene, chosen, times=times, rigid=True), up=_up(document), chosen=said)


def directions(document: Document) -> tuple[str, ...]:
    """Return "normals" and "tangents" if a mesh has them; `evaluate_document` omits both."""
    primitives = [each for mesh in json_array(document.json, "meshes") for each in mesh.get("primitives", [])]
    return tuple(
        word
        for word, name in (("normals", "NORMAL"), ("tangents", "TANGENT"))
        if any(name in each.get("attributes", {}) for each in primitives)
    )


def _up(document: Document) -> str:
    extras = [node.get("extras") for node in json_array(document.json, "nodes")]
    said = [each.get("gltf_anim") for each in extras if isinstance(each, dict)]
    return "z" if any(isinstance(each, dict) and each.get("up") == "z" for each in said) else "y"
