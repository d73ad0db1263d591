"""Options of a bake, its frame times, and the source document of its output."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from anim.arrays import Floats
from anim.caches.registry import CACHE_FORMATS
from anim.caches.source_document.bake_source import BakeSource, baked_meshes, self_contained
from anim.caches.source_document.lit_meshes import has_lit_normals, has_mapped_tangents
from anim.caches.source_document.shading_normals import with_shading_normals
from anim.caches.transforms.resample import SAME_FRAME_TOLERANCE_S
from anim.errors import RangeError
from anim.gltf.document import Document
from anim.gltf.io.source import Source, copy_external_images
from anim.gltf.reading import reader
from anim.gltf.writing.draco_decoding import decode_draco
from anim.model import Clip, Scene, VertexCache
from anim.operations.selection import Selection
from anim.sampling.times import frame_times
from anim.skinning.bake import Baker, bakeable_instances, prepare_bake


class Output(NamedTuple):
    """An output file, the file extension of its format, and whether it is only tried."""

    path: str
    ending: str
    dry_run: bool


@dataclass(frozen=True, slots=True)
class BakeOptions:
    """Options of the bake of all clips; see `prepare_bake`. start, end: s, of the clip; None for its own ends."""

    method: str
    blend: float | None
    bulge_clamp: bool
    space: str
    normals: bool
    tangents: bool
    rigid: bool
    fps: float | None
    start: float | None
    end: float | None

    def baker(self, scene: Scene, nodes: Sequence[int] | None) -> Baker:
        """Return the baker of meshes."""
        return prepare_bake(
            scene,
            method=self.method,
            blend=self.blend,
            bulge_clamp=self.bulge_clamp,
            space=self.space,
            normals=self.normals or self.tangents,
            tangents=self.tangents,
            rigid=self.rigid,
            nodes=nodes,
        )

    def times(self, clip: Clip) -> Floats:
        """Return the frame times of a clip: its keys, or frames at the rate, and both ends of the range.

        Raises RangeError for a range outside the clip.
        """
        first = clip.start if self.start is None else max(self.start, clip.start)
        last = clip.end if self.end is None else min(self.end, clip.end)
        if (self.start, self.end) == (None, None):
            return clip.key_times if self.fps is None else frame_times(first, last, fps=self.fps)
        if not first <= last:
            raise RangeError(
                f"the range from {first:g} s to {last:g} s is empty (the clip goes from {clip.start:.4g} s to "
                f"{clip.end:.4g} s)"
            )
        if last - first < SAME_FRAME_TOLERANCE_S:
            return np.array([first])
        if self.fps is not None:
            return frame_times(first, last, fps=self.fps)
        inside = clip.key_times[(clip.key_times > first) & (clip.key_times < last)]
        return np.unique(np.concatenate(([first], inside, [last])))


def default_directions(
    document: Document, scene: Scene, nodes: Sequence[int] | None, ending: str, *, rigid: bool
) -> tuple[bool, bool]:
    """Return whether normals and tangents are baked by default: in formats with materials that show them."""
    if not (keeps_materials(ending) and "tangents" in CACHE_FORMATS[ending].holds):
        return False, False
    chosen = [each.node for each in bakeable_instances(scene, rigid=rigid, nodes=nodes)]
    is_lit = has_lit_normals(document.json, chosen)
    return is_lit, is_lit and has_mapped_tangents(document.json, chosen)


def keeps_materials(ending: str) -> bool:
    """Return whether a format takes materials from the source."""
    return "source" in CACHE_FORMATS[ending].takes


def keeps_nodes(ending: str) -> bool:
    """Return whether a format keeps nodes, and so meshes that are not baked."""
    return "layout" in CACHE_FORMATS[ending].takes


def onto_source(
    cache: VertexCache,
    source: Source,
    clip: int | None,
    *,
    output: Output,
    keep_skeleton: bool = False,
) -> tuple[VertexCache, BakeSource]:
    """Return a cache in world space with normals if the source is lit, and the source.

    clip: index of its clip. Raises RangeError for vertices that do not fit.
    """
    document = prepare_source(
        source.document, source, {each.mesh for each in baked_meshes(cache, source.document)}, output
    )
    if "tangents" in CACHE_FORMATS[output.ending].holds:
        cache = with_shading_normals(cache, document)
    return cache, BakeSource(document, clip, keep_skeleton=keep_skeleton)


def choose_clip(source: Source, globs: Sequence[str] | None) -> int | None:
    """Return the index of the clip that globs select, or of the only one; None for several or none."""
    names = reader.names(source.document)
    chosen = Selection(globs).chosen_clips(names) if globs else range(len(names))
    return chosen[0] if len(chosen) == 1 else None


def prepare_source(document: Document, source: Source, meshes: set[int], output: Output) -> Document:
    """Return a document of a source with its images inside, or for a .gltf with images valid in its folder.

    There they are copied to if it is another folder. Meshes are without Draco data.
    """
    if output.ending != ".gltf":
        return self_contained(document, source, meshes)
    document = decode_draco(document, meshes)
    if source.folder is None or source.is_in_folder(output.path):
        return document
    return copy_external_images(document, source.folder, output.path, dry_run=output.dry_run)
