"""A flip-book in the source document: a mesh a frame for every baked one, one visible at a time."""

from __future__ import annotations

from anim.caches.formats import flipbook_keys
from anim.caches.source_document.bake_source import BakeSource, baked_meshes
from anim.caches.source_document.document_edit import DocumentEdit
from anim.caches.source_document.primitives import BakedVertices, baked_mesh
from anim.errors import UnsupportedError
from anim.gltf.document import Document, Json
from anim.gltf.io.container import MAX_GLB_BYTES
from anim.model import VertexCache


def replace_by_pages(cache: VertexCache, source: BakeSource, *, extras: Json, by_scale: bool) -> Document:
    """Return the source document with pages in place of skins; they share indices, attributes and materials.

    extras: of the parent of the pages of each mesh. by_scale: pages are switched by their scale, else by
    KHR_node_visibility. Raises UnsupportedError above 4 GiB.
    """
    frame_bytes = (12 + 12 * cache.has_normals + 16 * cache.has_tangents) * cache.vertex_count
    if frame_bytes * cache.frame_count > MAX_GLB_BYTES:
        raise UnsupportedError(
            f"{cache.frame_count} pages of {frame_bytes} bytes don't fit into a GLB", help="choose fewer with `fps`"
        )
    edit = DocumentEdit.of(source, baked_meshes(cache, source.document))
    pages = _pages(edit, cache, by_scale=by_scale)
    for i, baked in enumerate(edit.meshes):
        nodes = [flipbook_keys.page(row[i], frame, by_scale=by_scale) for frame, row in enumerate(pages)]
        first = edit.place_group(baked, nodes, {"extras": extras})
        _animate(edit, cache, first, by_scale=by_scale)
    edit.require(*flipbook_keys.extensions(cache.frame_count, by_scale=by_scale), optional=True)
    return edit.document()


def _pages(edit: DocumentEdit, cache: VertexCache, *, by_scale: bool) -> list[list[int]]:
    """Mesh indices of every page of every baked mesh; the first replaces the source's mesh."""
    source, pages = edit.source.document.json, list[list[int]]()
    for chunk in cache.chunks():
        for k, positions in enumerate(chunk.positions):
            normals, tangents = (None if each is None else each[k] for each in (chunk.normals, chunk.tangents))
            vertices = BakedVertices(positions, normals, tangents, cache.handedness)
            row = []
            for baked in edit.meshes:
                mesh = baked_mesh(source, baked, edit.primitives(baked, vertices, {}))
                row.append(edit.add_mesh(mesh, None if pages else baked.mesh))
            pages.append(row)
    return pages


def _animate(edit: DocumentEdit, cache: VertexCache, first: int, *, by_scale: bool) -> None:
    """Channels of the pages of one mesh, from node `first` on; pages of a frame share a sampler."""
    if cache.frame_count == 1:
        return
    times = cache.times.astype("<f4")
    is_new = not edit.samplers
    for frame in range(cache.frame_count):
        if is_new:
            keys = edit.new.add(flipbook_keys.keys(times, frame)[:, None], bounds=True)
            values = edit.new.add(flipbook_keys.visible(frame, cache.frame_count, by_scale=by_scale))
            edit.add_sampler(keys, values, "STEP")
        target = flipbook_keys.target(first + frame, by_scale=by_scale)
        edit.channels.append({"sampler": frame, "target": target})
