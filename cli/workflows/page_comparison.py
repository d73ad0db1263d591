"""Comparison of two files on a page: errors over time, and the state that shows the worst."""

from __future__ import annotations

from collections.abc import Sequence

from anim.errors import AnimError
from anim.gltf.reading import reader
from anim.measure.error.metric import ErrorMetric
from anim.model import Clip, Scene
from anim.show.page.bakes import bake_content, left_out_instances, with_left_out
from anim.show.page.comparison import compare_clips, compare_content
from anim.show.page.page import EMPTY, PageContent, PageFile, PageView
from anim.show.page.paired_meshes import PairedMeshes, pair_cache_meshes, pair_nodes
from cli.io.scenes import read_scene
from cli.reports import bake_notes
from cli.text import Reporter, format_length
from cli.workflows.mesh_pairs import is_bake_of, node_pairs


def compare_files(one: PageFile, other: PageFile, reporter: Reporter, *, clip: str | None = None) -> PageContent:
    """Return errors over time, where both files can be measured by joints; else the page measures vertices by itself.

    clip: name of the first file's clip that a bake or a cache is of.
    """
    try:
        (old, old_clips), (new, new_clips) = _read(one, reporter), _read(other, reporter)
        clips = old_clips, new_clips
        is_cached = one.cache is not None or other.cache is not None
        counts = len(clips[0]), len(clips[1])
        if is_cached or is_bake_of(old, new, counts[1]) or is_bake_of(new, old, counts[0]):
            meshes = pair_cache_meshes(one, other) if is_cached else _pair_bake(old, new, counts[1])
            partners = {_played(clips, clip): 0} if len(clips[1]) == 1 else {}
            is_first = one.cache is None if is_cached else is_bake_of(old, new, counts[1])
            source, scene, baked = (one, old, other) if is_first else (other, new, one)
            content = bake_content(source, meshes, partners, is_first=is_first)
            words = bake_notes.only_baked_words(left_out_instances(scene, content), baked.name)
            num_others = max(counts[0 if is_first else 1] - 1, 0) if partners else 0
            return with_left_out(content, scene, words, clips=num_others)
        ruler = ErrorMetric(old, new, clips=clips[0] + clips[1])
        return compare_content(ruler, *clips, compare_clips(ruler, *clips))
    except AnimError as error:
        reporter.info(f"note: without errors over time: {error}")
        return EMPTY


def _read(file: PageFile, reporter: Reporter) -> tuple[Scene, tuple[Clip, ...]]:
    """Scene and clips of a file; errors name it."""
    try:
        return read_scene(file.document, file.name, reporter), reader.clips(file.document)
    except AnimError as error:
        raise error.at(file.name, ": ") from None


def describe_worst(file: PageFile, content: PageContent) -> str:
    """Return the largest error of all clips: "max 22 cm in 'Run' at 'tail3', 0.458 s"; "" where none was measured."""
    if not content.errors:
        return ""
    index = max(content.errors, key=lambda i: content.errors[i].max)
    worst = content.errors[index]
    words = f"max {format_length(worst.max)}"
    if not worst.max:
        return words
    where = f" at '{worst.joint}'" if worst.joint else ""
    clip = reader.quote_clip(reader.names(file.document)[index], index)
    return f"{words} in {clip}{where}, {worst.time:.3f} s"


def _played(clips: tuple[Sequence[Clip], Sequence[Clip]], clip: str | None) -> int:
    """Index of the first file's clip by its name, else by that of the second file's only clip, else 0."""
    names = [reader.clip_name(each.name, i) for i, each in enumerate(clips[0])]
    return next((names.index(name) for name in (clip, clips[1][0].name) if name in names), 0)


def _pair_bake(old: Scene, new: Scene, num_clips: int) -> PairedMeshes:
    """Meshes of a file and its bake, in either order."""
    if is_bake_of(old, new, num_clips):
        return pair_nodes(node_pairs(old, new))
    baked, source = pair_nodes(node_pairs(new, old))
    return source, baked


def worst_view(file: PageFile, content: PageContent) -> PageView:
    """Return the view of the largest error, with heat: paused there if there is one."""
    links = (row.link for panel in content.panels for row in panel.rows if row.link is not None)
    link = next((link for link in links if link.clip is not None), None)
    if link is None or link.clip is None:
        clip = next(iter(content.partners), 0)
        names = reader.names(file.document)
        return PageView(reader.clip_name(names[clip], clip) if names else None, show=("heat",))
    return PageView(reader.clip_name(reader.names(file.document)[link.clip], link.clip), None, link.time, ("heat",))
