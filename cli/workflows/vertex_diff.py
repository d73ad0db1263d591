"""`diff` by vertex, where one of the two files is a cache, or a bake of the other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import PurePath

from anim.caches.options import ReadOptions
from anim.caches.registry import CACHE_FORMATS
from anim.errors import AnimError, RangeError
from anim.gltf.document import Document
from anim.gltf.reading import reader
from anim.measure.compare.vertex_distance import vertex_distance
from anim.model import Clip, Scene, VertexCache
from anim.operations.selection import Selection
from anim.units import list_some
from cli.errors import UsageError
from cli.io import cache_files, documents, scenes
from cli.reports.vertex_report import VertexReport
from cli.text import Reporter
from cli.workflows import mesh_pairs, vertex_motion
from cli.workflows.vertex_motion import VertexMotion, cache_motion, common_times, pair_documents, pair_with_cache

GLTF = (".glb", ".gltf")


@dataclass(frozen=True, slots=True)
class ComparedFile:
    """A file: its document and scene, or its cache."""

    name: str
    size: int
    document: Document | None
    cache: VertexCache | None
    scene: Scene | None = None

    def scene_of(self) -> Scene:
        """Return the scene of a document."""
        assert self.scene is not None
        return self.scene


def compare_document(name: str, size: int, document: Document, scene: Scene) -> ComparedFile:
    """Return a glTF file for a comparison, a flip-book as a cache."""
    return ComparedFile(name, size, document, mesh_pairs.pages_of(document), scene)


def is_cache(path: str | None) -> bool:
    """Return whether a path has the file extension of a cache that is no glTF."""
    ending = PurePath(path or "").suffix.lower()
    return ending in CACHE_FORMATS and ending not in GLTF


def diff_by_vertex(
    old: str, new: str, clips: Sequence[str], fps: float, reporter: Reporter, *, opened: Mapping[str, ComparedFile]
) -> VertexReport:
    """Compare two files by vertex, at all keys and frames of both, half-way between, and at `fps` per second.

    clips: globs for the clip of the glTF file; the cache's by name, or the only one. opened: files that were read
    already, by name.
    """
    with ExitStack() as stack:
        one, other = (
            opened.get(documents.called(path)) or stack.enter_context(open_compared(path, reporter))
            for path in (old, new)
        )
        return diff_opened(one, other, clips, fps, reporter)


def diff_opened(
    one: ComparedFile, other: ComparedFile, clips: Sequence[str], fps: float, reporter: Reporter
) -> VertexReport:
    """Compare two files by vertex, like `diff_by_vertex`."""
    label, first, second = _motions(one, other, clips, reporter)
    try:
        times = common_times(first, second, fps)
    except AnimError as error:
        raise error.at(one.name, ": ") from None
    found = vertex_distance(times, first.frames(times), second.frames(times), diagonal=first.diagonal())
    mesh, vertex = vertex_motion.locate(first if first.labels else second, max(found.vertex, 0))
    return VertexReport((one.name, other.name), (one.size, other.size), label, found, mesh, vertex, fps)


@contextmanager
def open_compared(path: str, reporter: Reporter) -> Iterator[ComparedFile]:
    """Give the file at `path`; errors raised inside name it."""
    if is_cache(path):
        with cache_files.load(path, ReadOptions()) as loaded:
            for words in loaded.notes:
                reporter.warn(words)
            yield ComparedFile(loaded.name, loaded.size, None, loaded.cache)
    else:
        with documents.source(path, reporter) as source:
            scene = scenes.read_scene(source.document, source.name, reporter)
            yield compare_document(source.name, source.size, source.document, scene)


def _motions(
    one: ComparedFile, other: ComparedFile, globs: Sequence[str], reporter: Reporter
) -> tuple[str, VertexMotion, VertexMotion]:
    """Name of the clip, and both motions."""
    if one.cache is not None and other.cache is not None:
        if one.cache.vertex_count != other.cache.vertex_count:
            counts = f"{one.cache.vertex_count} vertices and {other.cache.vertex_count}"
            raise RangeError(f"{one.name} and {other.name} have {counts} (expected the same)")
        return "", cache_motion(one.cache), cache_motion(other.cache)
    if other.cache is not None and one.document is not None:
        label, clip = _clip(one, one.document, globs)
        return label, *pair_with_cache(one.document, one.scene_of(), clip, other.cache)
    if one.cache is not None and other.document is not None:
        label, clip = _clip(other, other.document, globs)
        second, first = pair_with_cache(other.document, other.scene_of(), clip, one.cache)
        return label, first, second
    assert one.document is not None
    assert other.document is not None
    if mesh_pairs.is_bake_of(one.scene_of(), other.scene_of(), len(reader.names(other.document))):
        return _of_documents((one, one.document), (other, other.document), globs, reporter)
    label, second, first = _of_documents((other, other.document), (one, one.document), globs, reporter)
    return label, first, second


def _of_documents(
    source: tuple[ComparedFile, Document],
    baked: tuple[ComparedFile, Document],
    globs: Sequence[str],
    reporter: Reporter,
) -> tuple[str, VertexMotion, VertexMotion]:
    """Name of the clip, and the motions of a source and of its bake, which has one clip."""
    (played,) = reader.clips(baked[1])[:1] or (Clip("", ()),)
    same = [f"#{i}" for i, name in enumerate(reader.names(source[1])) if name == played.name]  # the name can be empty
    label, clip = _clip(*source, globs or same)
    sides = ((source[0].scene_of(), clip), (baked[0].scene_of(), played))
    first, second, missing = pair_documents(*sides)
    if missing:
        reporter.warn(f"{baked[0].name}: has no mesh like {list_some(missing)}")
    return label, first, second


def _clip(side: ComparedFile, document: Document, globs: Sequence[str]) -> tuple[str, Clip]:
    """The selected clip of a document, or its only one, with its name for tables, "" for none."""
    clips = reader.clips(document)
    chosen = Selection(globs).chosen_clips(reader.names(document)) if globs else range(len(clips))
    if len(chosen) > 1:
        raise UsageError(f"{side.name} has {len(clips)} clips, a cache has one", help="choose one with --clip")
    return (reader.clip_name(clips[chosen[0]].name, chosen[0]), clips[chosen[0]]) if chosen else ("", Clip("", ()))
