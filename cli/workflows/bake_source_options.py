"""The source documents of a bake's files, prepared once where one serves many."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from anim.caches.source_document.bake_source import BakeSource
from anim.caches.source_document.still_source import without_animations
from anim.gltf.document import Document
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

    def option(self, number: int | None, clip: Clip, output: Output) -> Mapping[str, Any]:
        """Return the option for a clip, by its index and itself; none if the format keeps no materials."""
        if not keeps_materials(output.ending):
            return {}
        document = self._document(output)
        if not keeps_nodes(output.ending):
            return self._made(document, None)
        options = self._options
        if number is not None and (options.start, options.end) != (None, None) and clip.end > clip.start:
            document = writer.replace_clips(document, {number: trim(clip, start=options.start, end=options.end)})
        return self._made(document, number)

    def _made(self, document: Document, clip: int | None) -> Mapping[str, Any]:
        in_mesh_space = self._options.space == "mesh"
        return {"source": BakeSource(document, clip, self._left_out, in_mesh_space, self._keep_skeleton)}

    def _document(self, output: Output) -> Document:
        """The prepared document; for a .gltf, whose images depend on its folder, of each file."""
        if output.ending == ".gltf":
            return prepare_source(self._source, self._meshes, output)
        if self._prepared is None:
            found = prepare_source(self._source, self._meshes, output)
            self._prepared = found if keeps_nodes(output.ending) else without_animations(found)
        return self._prepared
