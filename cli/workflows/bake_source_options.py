"""The source documents of a bake's files, prepared once where one serves many."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from anim.caches.source_document.bake_source import BakeSource
from anim.caches.source_document.single_clip_sources import SingleClipSources
from anim.caches.source_document.still_source import without_animations
from anim.gltf.document import Document, json_array
from anim.gltf.io.source import Source
from anim.gltf.writing import writer
from anim.model import Clip, Scene
from anim.operations.trim import trim
from anim.skinning.bake import bakeable_instances, left_out_nodes
from cli.workflows.bake_clip import BakeOptions, Output, keeps_materials, keeps_nodes, prepare_source


class BakeSources:
    """Write options `source` of the files of one group of meshes.

    nodes: of the baked meshes; None for all. Other meshes are then left out.
    """

    def __init__(
        self, source: Source, scene: Scene, nodes: Sequence[int] | None, options: BakeOptions, *, keep_skeleton: bool
    ) -> None:
        self._source, self._options, self._keep_skeleton = source, options, keep_skeleton
        baked = {each.node for each in bakeable_instances(scene, rigid=options.rigid, nodes=nodes)}
        self._meshes = {source.document.json["nodes"][node]["mesh"] for node in baked}
        self._left_out = left_out_nodes(scene, rigid=options.rigid, nodes=nodes)
        self._prepared: Document | None = None
        self._single: SingleClipSources | None = None

    def option(self, number: int | None, clip: Clip, output: Output) -> Mapping[str, Any]:
        """Return the option for a clip, by its index and itself; none if the format keeps no materials."""
        if not keeps_materials(output.ending):
            return {}
        if number is None or not keeps_nodes(output.ending):
            return self._made(self._document(output), None)
        options = self._options
        if (options.start, options.end) != (None, None) and clip.end > clip.start:
            trimmed = trim(clip, start=options.start, end=options.end)
            return self._made(writer.replace_clips(self._document(output), {number: trimmed}), number)
        return self._made(self._of_clip(number, output), 0)

    def _made(self, document: Document, clip: int | None) -> Mapping[str, Any]:
        in_mesh_space = self._options.space == "mesh"
        num_clips = len(json_array(self._source.document.json, "animations"))
        return {"source": BakeSource(document, clip, self._left_out, in_mesh_space, self._keep_skeleton, num_clips)}

    def _document(self, output: Output) -> Document:
        """The prepared document; for a .gltf, whose images depend on its folder, of each file."""
        if output.ending == ".gltf":
            return self._prepare(self._source.document, output)
        if self._prepared is None:
            found = self._prepare(self._source.document, output)
            self._prepared = found if keeps_nodes(output.ending) else without_animations(found)
        return self._prepared

    def _of_clip(self, number: int, output: Output) -> Document:
        """The prepared document without other clips: those of files with thousands take longer than the bake."""
        is_text = output.ending == ".gltf"
        if self._single is None:
            self._single = SingleClipSources(self._source.document if is_text else self._document(output))
        document = self._single.document(number)
        return self._prepare(document, output) if is_text else document

    def _prepare(self, document: Document, output: Output) -> Document:
        return prepare_source(document, self._source, self._meshes, output)
