"""glTF document → VertexCache: evaluates skins by linear blend, morph targets, nodes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from anim.arrays import Floats
from anim.errors import NotFoundError
from anim.gltf.document import Document, json_array
from anim.gltf.reading import reader
from anim.model import Clip, VertexCache
from anim.sampling import frame_times
from anim.skinning.analysis.weight_sums import unnormalized_weights
from anim.skinning.bake import bake


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
    times = frame_times(chosen.start, chosen.end, fps=fps) if fps is not None else _keys(chosen)
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


def _keys(clip: Clip) -> Floats:
    axes = clip.axes
    return np.unique(np.concatenate(axes)) if axes else np.zeros(1)


def _up(document: Document) -> str:
    extras = [node.get("extras") for node in json_array(document.json, "nodes")]
    said = [each.get("gltf_anim") for each in extras if isinstance(each, dict)]
    return "z" if any(isinstance(each, dict) and each.get("up") == "z" for each in said) else "y"
