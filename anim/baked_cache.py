"""BakedCache: a vertex cache with the asset that it was baked from, and a `save` method."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any, NamedTuple

from anim.arguments import Length, file_path, meters
from anim.asset import Asset, AssetLike, PathName, as_asset
from anim.caches import cache_file
from anim.caches.options import WriteOptions
from anim.caches.registry import CACHE_FORMATS, writer_for
from anim.caches.source_document.bake_source import BakeSource, baked_meshes, self_contained
from anim.caches.source_document.shading_normals import with_shading_normals
from anim.caches.storage import suffix
from anim.caches.transforms import statistics, up_axis
from anim.caches.transforms.vertex_order import reorder
from anim.errors import RangeError
from anim.gltf.authoring import add_clips
from anim.gltf.document import Document
from anim.gltf.io import container
from anim.gltf.writing.writer import replace_clips
from anim.model import Clip, VertexCache
from anim.operations.trim import trim


class BakeOrigin(NamedTuple):
    """The asset and the clip of a bake.

    clip_index: in the asset; None for a clip that it does not have. left_out: nodes whose meshes were not selected.
    in_mesh_space: as of the bake. has_own_times: whether its frames are at given times, perhaps of a part of the clip.
    """

    asset: Asset
    clip: Clip
    clip_index: int | None
    left_out: frozenset[int]
    in_mesh_space: bool
    has_own_times: bool


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BakedCache(VertexCache):
    """Vertex cache with a `save` method. Frames are baked on demand: `load_all()` returns all of them.

    origin: the asset that was baked, whose materials formats with materials keep; None for none.
    """

    origin: BakeOrigin | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the frames themselves: the bake can't be sent to other processes."""
        values: dict[str, Any] = {each.name: getattr(self, each.name) for each in fields(self)}
        return partial(BakedCache, **values | {"chunks": partial(iter, (self.load_all(),))}), ()

    def _repr_html_(self) -> str:
        """Return the page that plays the cache, for notebooks."""
        from anim.show.page import notebook
        from anim.show.page.page import page

        return notebook.frame(lambda: page(notebook.cache_file(self)), repr(self))

    def save(
        self,
        path: PathName,
        *,
        up: str = "y",
        vertex_order: str = "file",
        max_error: Length | None = None,
        quantize: bool = False,
        layout: str = "morph",
        preset: str = "plain",
        depth: str = "float",
        rest_mesh: str = ".ply",
        materials: bool = True,
        onto: AssetLike | None = None,
    ) -> None:
        """Write the cache in the format of the file extension, one of `anim.CACHE_FORMATS`.

        Options as of `gltf-anim bake`. materials: keep the materials, images and texture coordinates of the asset that
        was baked, in formats that have them; a .glb is then that file with other vertices. onto: an asset of which the
        cache is a bake in world space, in place of that one, as by `gltf-anim convert-cache --onto`.
        Raises UnsupportedError for another extension or a missing package, RangeError for an option that the format
        doesn't support, OutputError if the file can't be written.
        """
        name = file_path(path)
        writer_for(suffix(name))  # an unknown extension is refused first
        cache: VertexCache = up_axis.to_up_axis(reorder(self, vertex_order), up)
        limit = None if max_error is None else meters(max_error, "max_error", lambda: statistics.diagonal(cache))
        options = WriteOptions(limit, quantize, layout, preset, depth, rest_mesh)
        takes_source = "source" in CACHE_FORMATS[suffix(name)].takes
        if onto is not None:
            if not takes_source:
                raise RangeError(f"`onto` does not apply to {suffix(name)}")
            cache, source = _source(cache, suffix(name), as_asset(onto), None)
            options = replace(options, source=source)
        elif self.origin is not None and materials and takes_source:
            cache, source = _source(cache, suffix(name), self.origin.asset, self.origin)
            options = replace(options, source=source)
        cache_file.save(cache, name, options)


def _source(cache: VertexCache, ending: str, asset: Asset, origin: BakeOrigin | None) -> tuple[VertexCache, BakeSource]:
    """The cache with normals if the asset is lit and the format has them, and the asset with images inside."""
    document = container.check_edits(asset.document)
    meshes = {each.mesh for each in baked_meshes(cache, document)}
    document = self_contained(document, asset.source, meshes)
    if "tangents" in CACHE_FORMATS[ending].holds:
        cache = with_shading_normals(cache, document)
    if origin is None:
        return cache, BakeSource(document, 0 if len(asset.clips) == 1 else None)
    document, number = _with_clip(document, origin, cache)
    return cache, BakeSource(document, number, origin.left_out, origin.in_mesh_space)


def _with_clip(document: Document, origin: BakeOrigin, cache: VertexCache) -> tuple[Document, int | None]:
    """The document with the clip of the bake, cut to its frames, and the index of the clip."""
    clip, index = origin.clip, origin.clip_index
    if index is None and clip.tracks:
        document = add_clips(document, [clip])
        index = len(document.json["animations"]) - 1
    if index is not None and origin.has_own_times:
        first, last = max(float(cache.times[0]), clip.start), min(float(cache.times[-1]), clip.end)
        if first < last:
            document = replace_clips(document, {index: trim(clip, start=first, end=last)})
    return document, index
